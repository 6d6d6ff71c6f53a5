// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/trend.h"

#include <algorithm>
#include <map>

#include "app/batch/nights/runner.h"
#include "common/core/statistics.h"
#include "evaluation/measure/statistic.h"

namespace berth::nights {
namespace {

/// About eight names of nights under the axis.
std::vector<std::pair<double, std::string>> labels(const std::vector<Night>& nights) {
  std::vector<std::pair<double, std::string>> ticks;
  const std::size_t step = (nights.size() + 5) / 6;
  for (std::size_t i = 0; i < nights.size(); i += step) {
    const std::string& name = nights[nights.size() - 1 - i].name;
    // Of a date, month and day do.
    const bool is_date = name.size() >= 10 && name[4] == '-' && name[7] == '-';
    ticks.emplace_back(static_cast<double>(nights[nights.size() - 1 - i].number),
                       is_date ? name.substr(5) : name);
  }
  return ticks;
}

std::string title_of(const TrendSubject& subject) {
  if (subject.statistic == "value") return subject.phase + ": " + subject.measurement;
  if (evaluation::statistic_named(subject.statistic)) {
    return subject.phase + ": " + subject.statistic + " " + subject.measurement;
  }
  return "criterion: " + subject.statistic;
}

}  // namespace

report::Chart trend_chart(ResultStore& history, const std::vector<Night>& nights,
                          const TrendSubject& subject, const std::vector<std::int64_t>& flagged) {
  using Style = report::Curve::Style;
  std::map<std::int64_t, std::vector<double>> tonight;
  std::map<std::int64_t, std::vector<double>> baseline;
  for (const TrendValue& v : history.trend(nights.front().number, subject.case_name, subject.phase,
                                           subject.measurement, subject.statistic)) {
    (v.build == Build::tonight ? tonight : baseline)[v.batch].push_back(v.value);
  }
  // Of ones and zeros the mean is more informative than the median.
  const bool is_share = subject.measurement == evaluation::passed_measurement;
  const auto middle_of = [&](const std::vector<double>& values) {
    return is_share ? mean(values) : berth::median(values);
  };
  report::Curve band{"10 to 90 % of the runs", Style::band, 1};
  report::Curve median{is_share ? "share of the runs" : "median", Style::line, 1};
  report::Curve dots{"", Style::dots, 1};
  report::Curve flagged_nights{"flagged", Style::dots, 2};
  report::Curve old{"baseline", Style::line};
  old.dashed = true;
  for (const auto& [night, values] : tonight) {
    const auto x = static_cast<double>(night);
    const double middle = middle_of(values);
    band.add(x, quantile(values, 0.1), quantile(values, 0.9));
    median.add(x, middle);
    const bool alarm = std::find(flagged.begin(), flagged.end(), night) != flagged.end();
    (alarm ? flagged_nights : dots).add(x, middle);
  }
  for (const auto& [night, values] : baseline) {
    old.add(static_cast<double>(night), middle_of(values));
  }
  report::Chart chart;
  chart.title = title_of(subject);
  chart.unit = subject.unit;
  chart.x_unit = "";
  chart.group = "nights";
  chart.curves = {band, old, median, dots};
  if (old.x.empty()) chart.curves.erase(chart.curves.begin() + 1);
  if (is_share) {
    chart.curves.erase(chart.curves.begin());
    chart.y_range = {-0.05, 1.05};
  }
  if (!flagged_nights.x.empty()) chart.curves.push_back(flagged_nights);
  chart.x_range = {static_cast<double>(nights.front().number) - 0.5,
                   static_cast<double>(nights.back().number) + 0.5};
  chart.x_ticks = labels(nights);
  chart.clip_extremes = true;
  chart.height_px = 120;
  return chart;
}

}  // namespace berth::nights
