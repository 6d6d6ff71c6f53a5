// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/change_report.h"

#include <cmath>

#include "common/core/table.h"
#include "common/core/text.h"

namespace berth::evaluation {
namespace {

/// Four digits that say something.
std::string number(double value, bool with_sign = false) {
  if (std::isnan(value)) return "-";
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  const double size = std::abs(value);
  const int decimals = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : size >= 1 ? 3 : 4;
  return (with_sign && value > 0 ? "+" : "") + fixed(value, decimals);
}

std::string p_text(double p) {
  if (std::isnan(p)) return "-";
  return p < 0.0001 ? "<0.0001" : fixed(p, 4);
}

std::vector<std::string> cells_of(const ChangeRow& row) {
  const PairedDifference& d = row.difference;
  return {row.phase,
          row.measurement + " " + row.statistic,
          row.unit,
          std::to_string(d.pairs),
          number(d.before),
          number(d.after),
          number(d.difference, true),
          "[" + number(d.low, true) + ", " + number(d.high, true) + "]",
          p_text(row.adjusted_p),
          text_of(row.judgement)};
}

}  // namespace

std::string text_of(const Change& change, double level) {
  Table table{"lllrrrrlrl",
              {"phase", "measurement", "unit", "pairs", "recorded", "again", "change",
               "[" + fixed(100 * (1 - level), 0) + " % interval]", "p", "judgement"}};
  std::string phase;
  for (const ChangeRow& row : change.rows) {
    if (!phase.empty() && row.phase != phase) table.rows.emplace_back();
    phase = row.phase;
    table.rows.push_back(cells_of(row));
  }
  Table statuses{"ll", {"recorded", "again", "estimates"}};
  for (const auto& [status, count] : change.statuses) {
    statuses.rows.push_back({status.first, status.second, std::to_string(count)});
  }
  return text_table(table) + "\nstatus:\n" + text_table(statuses) +
         "\nagainst truth: " + change.verdict() + "\n";
}

nlohmann::ordered_json json_of(const Change& change) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const ChangeRow& row : change.rows) {
    const PairedDifference& d = row.difference;
    rows.push_back({{"phase", row.phase},
                    {"measurement", row.measurement},
                    {"statistic", row.statistic},
                    {"unit", row.unit},
                    {"pairs", d.pairs},
                    {"recorded", d.before},
                    {"again", d.after},
                    {"difference", d.difference},
                    {"interval", {d.low, d.high}},
                    {"block", d.block},
                    {"p", d.p_value},
                    {"p_adjusted", row.adjusted_p},
                    {"judgement", text_of(row.judgement)}});
  }
  nlohmann::ordered_json statuses = nlohmann::ordered_json::array();
  for (const auto& [status, count] : change.statuses) {
    statuses.push_back(
        {{"recorded", status.first}, {"again", status.second}, {"estimates", count}});
  }
  return {
      {"runs", change.runs}, {"verdict", change.verdict()}, {"rows", rows}, {"statuses", statuses}};
}

}  // namespace berth::evaluation
