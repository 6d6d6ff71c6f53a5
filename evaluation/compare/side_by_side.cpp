// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/side_by_side.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/core/table.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::evaluation {
namespace {

/// Fewer give no interval; more take too long.
constexpr std::size_t min_pairs = 10;
constexpr std::size_t max_pairs = 20000;

bool has_estimates(const Measurer& run, const Phase& phase) {
  return std::any_of(run.compared().begin(), run.compared().end(),
                     [&](const ComparedEstimate& c) { return phase.contains(c.estimate.utime); });
}

std::vector<std::string> phases_of(const std::vector<const Measurer*>& runs) {
  std::vector<std::string> names;
  for (const Measurer* run : runs) {
    for (const Phase& phase : run->record().phases()) {
      if (phase.name == teardown_phase || phase.name == whole_run) continue;
      if (!has_estimates(*run, phase)) continue;
      if (std::find(names.begin(), names.end(), phase.name) == names.end()) {
        names.push_back(phase.name);
      }
    }
  }
  names.push_back(whole_run);
  return names;
}

/// The statistic of both series at the times that they share; nothing where they share few.
std::optional<PairedDifference> difference_of(const Measurement& what, const Series& before,
                                              const Series& after) {
  std::vector<double> a;
  std::vector<double> b;
  std::size_t j = 0;
  for (std::size_t i = 0; i < before.utime.size(); ++i) {
    while (j < after.utime.size() && after.utime[j] < before.utime[i]) ++j;
    if (j == after.utime.size() || after.utime[j] != before.utime[i]) continue;
    a.push_back(what.shown(before.value[i]));
    b.push_back(what.shown(after.value[j]));
  }
  if (a.size() < min_pairs || a.size() > max_pairs || a == b) return std::nullopt;
  BootstrapOptions options;
  options.resamples = 1000;
  options.swaps = 2000;
  options.block = 0;
  return paired_difference(Statistic::rms, a, b, options);
}

SideBySideRow row_of_series(const Measurement& what, const std::string& phase,
                            const std::vector<const Measurer*>& runs) {
  SideBySideRow row{phase, "rms " + what.name, what.unit, {}, {}};
  std::vector<Series> series;
  for (const Measurer* run : runs) {
    const auto its_phase = run->record().phase(phase);
    series.push_back(its_phase ? what.series(*run, *its_phase) : Series());
    row.values.push_back(what.shown(compute(Statistic::rms, series.back().value)));
    row.paired.push_back(series.size() == 1 ? std::nullopt
                                            : difference_of(what, series.front(), series.back()));
  }
  return row;
}

SideBySideRow row_of_number(const Measurement& what, const std::string& phase,
                            const std::vector<const Measurer*>& runs) {
  SideBySideRow row{phase, what.name, what.unit, {}, {}};
  for (const Measurer* run : runs) {
    const auto its_phase = run->record().phase(phase);
    row.values.push_back(its_phase ? what.shown(what.number(*run, *its_phase).value)
                                   : std::numeric_limits<double>::quiet_NaN());
    row.paired.emplace_back();
  }
  return row;
}

}  // namespace

std::vector<SideBySideRow> compare_side_by_side(const std::vector<const Measurer*>& runs) {
  std::vector<SideBySideRow> rows;
  for (const std::string& phase : phases_of(runs)) {
    for (const Measurement& what : measurements()) {
      SideBySideRow row =
          what.series ? row_of_series(what, phase, runs) : row_of_number(what, phase, runs);
      const bool any = std::any_of(row.values.begin(), row.values.end(),
                                   [](double v) { return std::isfinite(v); });
      if (any) rows.push_back(std::move(row));
    }
  }
  return rows;
}

std::string text_of_side_by_side(const std::vector<std::string>& names,
                                 const std::vector<SideBySideRow>& rows) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += "run " + std::to_string(i + 1) + ": " + names[i] + "\n";
  }
  Table table{"lll", {"phase", "measurement", "unit"}};
  for (std::size_t i = 0; i < names.size(); ++i) {
    table.head.push_back("run " + std::to_string(i + 1));
    if (i == 0) continue;
    table.head.push_back("- run 1");
    table.head.push_back("paired, 95 %");
  }
  for (const SideBySideRow& row : rows) {
    std::vector<Table::Cell> line = {row.phase, row.measurement, row.unit};
    for (std::size_t i = 0; i < row.values.size(); ++i) {
      line.push_back(shown(row.values[i]));
      if (i == 0) continue;
      line.push_back(shown(row.values[i] - row.values[0]));
      const auto& p = row.paired[i];
      line.push_back(p ? shown(p->low) + " to " + shown(p->high) : "");
    }
    table.rows.push_back(line);
  }
  return text + "\n" + text_table(table);
}

std::string json_of_side_by_side(const std::vector<SideBySideRow>& rows) {
  auto list = nlohmann::ordered_json::array();
  for (const SideBySideRow& row : rows) {
    auto values = nlohmann::ordered_json::array();
    auto paired = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < row.values.size(); ++i) {
      values.push_back(row.values[i]);
      const auto& p = row.paired[i];
      paired.push_back(p ? nlohmann::ordered_json{{"pairs", p->pairs},
                                                  {"difference", p->difference},
                                                  {"low", p->low},
                                                  {"high", p->high},
                                                  {"p_value", p->p_value}}
                         : nlohmann::ordered_json(nullptr));
    }
    list.push_back({{"phase", row.phase},
                    {"measurement", row.measurement},
                    {"unit", row.unit},
                    {"values", values},
                    {"paired_with_first", paired}});
  }
  return json_text(list, 2);
}

}  // namespace berth::evaluation
