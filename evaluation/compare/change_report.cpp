// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/change_report.h"

#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "common/core/text.h"

namespace berth::evaluation {
namespace {

[[gnu::format(printf, 1, 2)]] std::string line(const char* format, ...) {
  char text[200];
  va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof text, format, values);
  va_end(values);
  return text;
}

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

std::string text_of(const ChangeRow& row) {
  const PairedDifference& d = row.difference;
  const std::string name = row.measurement + " " + row.statistic;
  const std::string interval = "[" + number(d.low, true) + ", " + number(d.high, true) + "]";
  return line("%-10s %-28s %-6s %6zu %9s %9s %9s  %-22s %8s  %s\n", row.phase.c_str(), name.c_str(),
              row.unit.c_str(), d.pairs, number(d.before).c_str(), number(d.after).c_str(),
              number(d.difference, true).c_str(), interval.c_str(), p_text(row.adjusted_p).c_str(),
              text_of(row.judgement));
}

}  // namespace

std::string text_of(const Change& change, double level) {
  std::string text = line("%-10s %-28s %-6s %6s %9s %9s %9s  %-22s %8s\n", "phase", "measurement",
                          "unit", "pairs", "recorded", "again", "change",
                          ("[" + fixed(100 * (1 - level), 0) + " % interval]").c_str(), "p");
  std::string phase;
  for (const ChangeRow& row : change.rows) {
    if (!phase.empty() && row.phase != phase) text += "\n";
    phase = row.phase;
    text += text_of(row);
  }
  text += "\nstatus, recorded and again:\n";
  for (const auto& [statuses, count] : change.statuses) {
    text += line("  %-10s -> %-10s %8lld\n", statuses.first.c_str(), statuses.second.c_str(),
                 static_cast<long long>(count));
  }
  text += "\nagainst truth: " + change.verdict() + "\n";
  return text;
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
