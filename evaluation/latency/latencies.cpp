// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/latency/latencies.h"

#include <cmath>

#include "common/core/text.h"

namespace berth::evaluation {
namespace {

std::string milliseconds(double seconds) {
  return std::isfinite(seconds) ? fixed(1e3 * seconds, 2) : "";
}

}  // namespace

Table latency_table(const std::vector<Latency>& latencies) {
  constexpr const char* kinds[] = {"delay", "clock", "round trip"};
  constexpr const char* bases[] = {"motion", "clock map", "round trip"};
  Table table{"ll",
              {keyed("latency", "name"), json_only("kind"), no_json("from"), keyed("ms", "value_s"),
               keyed("95 % low", "low_s"), keyed("high", "high_s"), "samples", json_only("remark"),
               json_only("sigma_information_s"), json_only("sigma_bootstrap_s"),
               json_only("sigma_truth_offset_s")}};
  for (const Latency& l : latencies) {
    const auto kind = static_cast<std::size_t>(l.kind);
    const bool clock = l.kind == Latency::Kind::clock;
    const double about = clock ? l.value : 0;
    std::vector<Table::Cell> cells = {l.name,
                                      kinds[kind],
                                      bases[kind],
                                      valued(clock ? "" : milliseconds(l.value), l.value),
                                      valued(milliseconds(l.low - about), l.low),
                                      valued(milliseconds(l.high - about), l.high),
                                      l.samples,
                                      l.remark};
    if (l.kind == Latency::Kind::delay) {
      cells.insert(cells.end(), {valued("", l.sigma_information), valued("", l.sigma_bootstrap),
                                 valued("", l.sigma_offset)});
    }
    const std::string offset = clock ? "offset " + fixed(l.value, 6) + " s, " : "";
    table.rows.push_back({std::move(cells), Table::none, l.name, offset + l.remark});
  }
  return table;
}

}  // namespace berth::evaluation
