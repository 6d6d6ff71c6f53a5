// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "common/core/nan.h"
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
    curve_.x.push_back(time);
    curve_.y.push_back(value);
  }
  void hole(double time) {
    curve_.x.push_back(time);
    curve_.y.push_back(nan);
  }

 private:
  Curve& curve_;
  std::size_t index_;
};

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
    estimate_curve.name = "estimate";
    estimate_curve.style = Curve::Style::dots;
    estimate_curve.colour = 1;
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

}  // namespace berth::report
