// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <variant>

#include "testbed/guidance/flight.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

/// The target's own motion during a closed loop, unknown to guidance: T_start_model, the
/// pose of the model in the frame that it had at the start. Null: it stays.
using TargetMotion = std::shared_ptr<const WaypointPath>;

/// Where the model is t seconds after the start; at the motion's end it stays.
inline Pose target_at(const TargetMotion& motion, double t) {
  return motion ? motion->at(t).pose : Pose{};
}

/// The relative path of the arms: a path relative to a target at rest, combined with the target's
/// own motion.
class MovingTargetPath final : public RelativePath {
 public:
  MovingTargetPath(std::shared_ptr<const RelativePath> path, TargetMotion motion)
      : path_(std::move(path)), motion_(std::move(motion)) {}
  double duration() const override { return std::max(path_->duration(), motion_->duration()); }
  Point at(double t) const override {
    Point point = path_->at(t);
    point.pose = point.pose * motion_->at(t).pose;
    return point;
  }

 private:
  std::shared_ptr<const RelativePath> path_;
  TargetMotion motion_;
};

/// The flight with exact and timely estimates: the path of the arms (T_sensor_model over time), or
/// why the flight would not reach its end. A pose is kept for as long as the target moves.
std::variant<std::shared_ptr<const RelativePath>, std::string> forecast(const Flight& flight,
                                                                        const TargetMotion& motion,
                                                                        std::int64_t now,
                                                                        std::int64_t dead_time);

}  // namespace berth::testbed
