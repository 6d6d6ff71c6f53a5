// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "testbed/motion/arm_allocation.h"
#include "testbed/motion/path_check.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

/// A relative path, delivered by both arms.
class RelativeMotion final : public ArmMotion {
 public:
  RelativeMotion(std::shared_ptr<const RelativePath> path, ArmAllocation allocation)
      : path_(std::move(path)), allocation_(std::move(allocation)) {}

  double duration() const override { return path_->duration(); }
  std::optional<ArmPair> at(double t, const ArmPair& near, std::string* reason) const override {
    const RelativePath::Point point = path_->at(t);
    return allocation_.joints(point.pose, point.progress, near, reason);
  }

 private:
  std::shared_ptr<const RelativePath> path_;
  ArmAllocation allocation_;
};

/// Along joints that the arms went through before, on a cubic spline whose velocity and
/// acceleration are continuous: the way back is as free as the way there was.
class RecordedMotion final : public ArmMotion {
 public:
  /// points: where to go through, beginning where the arms are; lengths: of relative travel between
  /// them (one less), in the unit that `travel` counts.
  RecordedMotion(std::vector<ArmPair> points, const std::vector<double>& lengths, double speed,
                 double acceleration, double jerk);

  double duration() const override { return travel_.duration(); }
  std::optional<ArmPair> at(double t, const ArmPair& near, std::string* reason) const override;

 private:
  std::vector<ArmPair> points_;
  std::vector<double> position_;  // of each point along the way
  std::vector<ArmPair> bend_;     // second derivative at each point
  SmoothTravel travel_;
};

}  // namespace berth::testbed
