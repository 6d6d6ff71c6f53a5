// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "common/core/nan.h"
#include "common/core/statistics.h"
#include "evaluation/report/axis.h"
#include "evaluation/report/sections.h"

namespace berth::report {
namespace {

/// One coordinate of poses over time. A jump of an angle past 180 degrees breaks the line.
class Coordinate {
 public:
  Coordinate(Curve& curve, std::size_t index) : curve_(curve), index_(index) {}

  void add(double time, const Xyzwpr& pose) {
    const double value = pose[index_];
    const bool angle = index_ >= 3;
    if (angle && !curve_.y.empty() && std::abs(value - curve_.y.back()) > 180) hole(time);
    curve_.add(time, value);
  }
  void hole(double time) { curve_.add(time, nan); }

 private:
  Curve& curve_;
  std::size_t index_;
};

const double chi_square_low = chi_squared_quantile(0.025, 6);
const double chi_square_high = chi_squared_quantile(0.975, 6);

Chart axis_chart(const RunView& view, Eigen::Index axis, const char* title) {
  const double unit = axis < 3 ? 1e-3 : radians(1.0);
  Chart chart = view.chart(title, axis < 3 ? "mm" : "deg");
  chart.clip_extremes = true;
  Curve truth_band{"truth's own 3\xCF\x83", Curve::Style::band};
  Curve band{"estimate's 3\xCF\x83", Curve::Style::band, 1};
  Curve error{"estimate \xE2\x88\x92 truth", Curve::Style::dots, 1};
  Utime last = 0;
  for (const evaluation::ComparedEstimate& c : view.measurer().compared()) {
    const double t = view.at(c.estimate.utime);
    const bool hole =
        last != 0 && c.estimate.utime - last > evaluation::Measurer::estimate_lifetime;
    last = c.estimate.utime;
    const auto add = [&](Curve& curve, double variance) {
      if (hole) curve.add(t, nan, nan);
      const double reach = 3 * std::sqrt(variance) / unit;
      curve.add(t, -reach, reach);
    };
    add(truth_band, c.truth.covariance(axis, axis));
    add(band, c.estimate.covariance(axis, axis));
    error.add(t, c.error(axis) / unit);
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
  Curve curve{"NEES", Curve::Style::dots, 1};
  for (std::size_t i = 0; i < series.value.size(); ++i) {
    curve.add(view.at(series.utime[i]), series.value[i]);
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

Html pose_section(const RunView& view) {
  const auto& truth = view.record().truth().samples();
  const auto& estimates = view.record().estimates();
  if (truth.empty() && estimates.empty()) return {};
  constexpr const char* names[] = {"x", "y", "z", "w", "p", "r"};
  std::vector<Chart> charts;
  std::vector<std::array<Curve, 2>> curves(6);
  for (auto& [true_curve, estimate_curve] : curves) {
    true_curve.name = "truth";
    estimate_curve = {"estimate", Curve::Style::dots, 1};
  }
  Utime last = 0;
  for (const evaluation::TruthSample& sample : truth) {
    const Xyzwpr pose = xyzwpr_from_pose(sample.pose);
    const bool hole = last != 0 && sample.utime - last > evaluation::TruthTrack::max_gap;
    last = sample.utime;
    for (std::size_t i = 0; i < 6; ++i) {
      Coordinate coordinate(curves[i][0], i);
      if (hole) coordinate.hole(view.at(sample.utime));
      coordinate.add(view.at(sample.utime), pose);
    }
  }
  for (const evaluation::EstimateSample& e : estimates) {
    if (!e.ok()) continue;
    const evaluation::ComparedEstimate* compared = view.measurer().compared_at(e.utime);
    const Xyzwpr pose = xyzwpr_from_pose(compared ? compared->estimate.pose : e.pose);
    for (std::size_t i = 0; i < 6; ++i) {
      Coordinate(curves[i][1], i).add(view.at(e.utime), pose);
    }
  }
  // Two columns: translation to the left, rotation to the right, as the pendant reads.
  for (const std::size_t i : {0u, 3u, 1u, 4u, 2u, 5u}) {
    Chart chart = view.chart(names[i], i < 3 ? "mm" : "deg");
    chart.min_span = i < 3 ? 1 : 0.1;
    for (Curve& curve : curves[i]) {
      if (!curve.x.empty()) chart.curves.push_back(std::move(curve));
    }
    charts.push_back(std::move(chart));
  }
  return grid_of(charts);
}

Html error_section(const RunView& view) {
  if (view.measurer().compared().empty()) return {};
  return grid_of({axis_chart(view, 0, "x (right)"), axis_chart(view, 3, "about x"),
                  axis_chart(view, 1, "y (down)"), axis_chart(view, 4, "about y"),
                  axis_chart(view, 2, "z (boresight)"), axis_chart(view, 5, "about z")}) +
         consistency(view);
}

Html return_section(const RunView& view) {
  const auto& estimates = view.details().estimates;
  if (estimates.empty()) return {};
  Curve residual{"rms", Curve::Style::dots, 1};
  Curve received{"returns", Curve::Style::dots};
  Curve used{"used", Curve::Style::dots, 1};
  Curve misses{"misses", Curve::Style::dots, 2};
  for (const EstimateDetail& e : estimates) {
    const double t = view.at(e.utime);
    if (const auto* compared = view.measurer().compared_at(e.utime)) {
      const double rms = view.measurer().residual(*compared);
      if (std::isfinite(rms)) residual.add(t, 1e3 * rms);
    }
    received.add(t, e.returns_received);
    used.add(t, e.returns_used);
    misses.add(t, e.misses);
  }
  Chart residuals =
      view.chart("distance of the target's returns from its surface as estimated", "mm");
  residuals.clip_extremes = true;
  residuals.curves = {residual};
  Chart returns = view.chart("beams of each scan", "");
  returns.clip_extremes = true;
  returns.curves = {received, misses, used};
  if (residual.x.empty()) return grid_of({returns});
  return grid_of({residuals, returns});
}

}  // namespace berth::report
