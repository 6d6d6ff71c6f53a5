// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/core/nan.h"
#include "common/core/statistics.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {
namespace {

const double chi_square_low = chi_squared_quantile(0.025, 6);
const double chi_square_high = chi_squared_quantile(0.975, 6);

Chart axis_chart(const RunView& view, Eigen::Index axis, const char* title) {
  const double unit = axis < 3 ? 1e-3 : radians(1.0);
  Chart chart = view.chart(title, axis < 3 ? "mm" : "deg");
  chart.clip_extremes = true;
  Curve truth_band;
  Curve band;
  Curve error;
  truth_band.name = "truth's own 3\xCF\x83";
  truth_band.style = Curve::Style::band;
  band.name = "estimate's 3\xCF\x83";
  band.style = Curve::Style::band;
  band.colour = 1;
  error.name = "estimate \xE2\x88\x92 truth";
  error.style = Curve::Style::dots;
  error.colour = 1;
  Utime last = 0;
  for (const evaluation::ComparedEstimate& c : view.measurer().compared()) {
    const double t = view.at(c.estimate.utime);
    const bool hole =
        last != 0 && c.estimate.utime - last > evaluation::Measurer::estimate_lifetime;
    last = c.estimate.utime;
    const auto add = [&](Curve& curve, double variance) {
      if (hole) {
        curve.x.push_back(t);
        curve.y.push_back(nan);
        curve.low.push_back(nan);
      }
      const double reach = 3 * std::sqrt(variance) / unit;
      curve.x.push_back(t);
      curve.y.push_back(reach);
      curve.low.push_back(-reach);
    };
    add(truth_band, c.truth.covariance(axis, axis));
    add(band, c.estimate.covariance(axis, axis));
    error.x.push_back(t);
    error.y.push_back(c.error(axis) / unit);
  }
  chart.curves = {band, truth_band, error};
  return chart;
}

Html consistency(const RunView& view) {
  const evaluation::Measurement* nees = evaluation::measurement_named("nees");
  const auto whole = view.record().phase(evaluation::whole_run);
  if (nees == nullptr || !whole) return {};
  const evaluation::Series series = nees->series(view.measurer(), *whole);
  if (series.value.empty()) return {};
  Chart chart = view.chart("NEES: error squared over its covariance", "");
  chart.log_y = true;
  chart.levels = {{chi_square_low, "2.5 %"}, {6, "6"}, {chi_square_high, "97.5 %"}};
  Curve curve;
  curve.name = "NEES";
  curve.style = Curve::Style::dots;
  curve.colour = 1;
  for (std::size_t i = 0; i < series.value.size(); ++i) {
    curve.x.push_back(view.at(series.utime[i]));
    curve.y.push_back(series.value[i]);
  }
  chart.curves.push_back(curve);
  const auto part = [&](auto condition) {
    const auto n = std::count_if(series.value.begin(), series.value.end(), condition);
    return brief(100.0 * static_cast<double>(n) / static_cast<double>(series.value.size()), 3);
  };
  const std::string words =
      "Median " + brief(evaluation::compute(evaluation::Statistic::p50, series.value), 3) +
      " (5.35 when consistent), mean " +
      brief(evaluation::compute(evaluation::Statistic::mean, series.value), 3) + " (6); " +
      part([](double v) { return v > chi_square_high; }) + " % above the 97.5 % bound and " +
      part([](double v) { return v < chi_square_low; }) +
      " % below the 2.5 % bound: above, the estimate is surer than it should be; below, less sure. "
      "Successive estimates are not independent.";
  return grid_of({chart}) + element("p", "note-wide", text(words));
}

}  // namespace

Html error_section(const RunView& view) {
  if (view.measurer().compared().empty()) return {};
  return grid_of({axis_chart(view, 0, "x (right)"), axis_chart(view, 3, "about x"),
                  axis_chart(view, 1, "y (down)"), axis_chart(view, 4, "about y"),
                  axis_chart(view, 2, "z (boresight)"), axis_chart(view, 5, "about z")}) +
         consistency(view);
}

}  // namespace berth::report
