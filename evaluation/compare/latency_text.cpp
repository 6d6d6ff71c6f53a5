// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/latency_text.h"

#include <cmath>

#include "common/core/table.h"
#include "common/core/text.h"
#include "evaluation/compare/comparison.h"

namespace berth::evaluation {
namespace {

constexpr std::size_t hash_shown = 8;

std::string milliseconds(double seconds) {
  return std::isfinite(seconds) ? fixed(1e3 * seconds, 2) : "";
}

const char* basis_word(Latency::Kind kind) {
  switch (kind) {
    case Latency::Kind::delay:
      return "motion";
    case Latency::Kind::clock:
      return "clock map";
    case Latency::Kind::trip:
      break;
  }
  return "round trip";
}

}  // namespace

std::vector<std::string> latency_cells(const Latency& l) {
  const bool clock = l.kind == Latency::Kind::clock;
  const double about = clock ? l.value : 0;
  const std::string offset = clock ? "offset " + fixed(l.value, 6) + " s, " : "";
  return {l.name,
          basis_word(l.kind),
          clock ? "" : milliseconds(l.value),
          milliseconds(l.low - about),
          milliseconds(l.high - about),
          std::to_string(l.samples),
          offset + l.remark};
}

std::string latency_table(const std::vector<Latency>& latencies) {
  if (latencies.empty()) return {};
  Table table{"ll", {"latency", "from", "ms", "95 % low", "high", "samples"}};
  std::string remarks;
  for (const Latency& l : latencies) {
    std::vector<std::string> cells = latency_cells(l);
    if (!cells.back().empty()) remarks += "  " + l.name + ": " + cells.back() + "\n";
    cells.pop_back();
    table.rows.push_back(std::move(cells));
  }
  return text_table(table) + remarks;
}

std::string truth_line(const Comparison& comparison) {
  std::string text;
  for (const TruthBasis& basis : comparison.truth_bases) {
    text += (text.empty() ? "" : " and ") + (basis.basis.empty() ? "nothing told" : basis.basis);
    if (!basis.calibration_hash.empty()) {
      text += " (calibration " + basis.calibration_hash.substr(0, hash_shown) + ")";
    }
  }
  if (text.empty()) return {};
  return text + ", 1 sigma " + shown(1e3 * comparison.truth_position_sigma) + " mm and " +
         shown(degrees(comparison.truth_attitude_sigma)) + " deg";
}

}  // namespace berth::evaluation
