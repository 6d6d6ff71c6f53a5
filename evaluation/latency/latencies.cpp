// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/latency/latencies.h"

#include <cmath>

#include "common/core/table.h"
#include "common/core/text.h"

namespace berth::evaluation {
namespace {

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

}  // namespace berth::evaluation
