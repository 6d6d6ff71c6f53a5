// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "common/core/text.h"
#include "logs/compare/comparison.h"

namespace berth::logs {
namespace {

constexpr std::size_t hash_shown = 8;

std::string milliseconds(double seconds) {
  return std::isfinite(seconds) ? fixed(1e3 * seconds, std::abs(seconds) < 10 ? 2 : 0) : "";
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

std::string latency_table(const std::vector<Latency>& latencies) {
  if (latencies.empty()) return {};
  std::vector<std::vector<std::string>> lines = {
      {"latency", "from", "ms", "95 % low", "high", "samples"}};
  std::string remarks;
  for (const Latency& l : latencies) {
    lines.push_back({l.name, basis_word(l.kind), milliseconds(l.value), milliseconds(l.low),
                     milliseconds(l.high), std::to_string(l.samples)});
    if (!l.remark.empty()) remarks += "  " + l.name + ": " + l.remark + "\n";
  }
  return text_table(lines, 2) + remarks;
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

}  // namespace berth::logs
