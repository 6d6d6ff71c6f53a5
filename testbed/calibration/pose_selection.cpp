// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/pose_selection.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/core/error.h"
#include "common/core/random.h"

namespace berth::testbed {
namespace {

using Eigen::MatrixXd;

/// rad to either side of home in which an arm's configurations are drawn: shoulder, wrist.
struct Reach {
  double shoulder;
  double wrist;
};
constexpr Reach replica_reach{0.6, 0.9};
constexpr Reach sensor_reach{0.4, 0.6};
constexpr int workspace_samples = 200;
constexpr int max_draws = 50000;
constexpr int max_plans = 25;  // tried for one pose
constexpr int both_arms_every = 6;
constexpr int min_poses = 10;

class Selector {
 public:
  Selector(const Cell& cell, const MotionPlanner& planner, const CalibrationView& view,
           const MatrixXd& prior, const SelectionOptions& options)
      : cell_(cell),
        planner_(planner),
        view_(view),
        options_(options),
        random_(options.seed, "calibration poses"),
        covariance_(prior) {
    Vector6d variance;
    variance.head<3>().setConstant(options.position_sigma * options.position_sigma);
    variance.tail<3>().setConstant(options.rotation_sigma * options.rotation_sigma);
    noise_ = variance.asDiagonal();
    // rotation and position are weighted as in the measurements
    weight_ = variance.cwiseInverse().asDiagonal();
    here_ = {cell.replica.home, cell.sensor.home};
    const ArmPair home = here_;
    MatrixXd mean = MatrixXd::Zero(calibration_size, calibration_size);
    for (int i = 0; i < workspace_samples; ++i) {
      const auto joints = draw(home, true, true);
      if (!joints) throw InputError("no configuration of the arms has the target in view");
      workspace_.push_back(calibration_jacobian(cell_, *joints));
      const CalibrationJacobian& jacobian = workspace_.back();
      mean += jacobian.transpose() * weight_ * jacobian / workspace_samples;
    }
    criterion_ = mean;
  }

  PoseSelection select(double fast_speed, const std::function<void(int)>& progress) {
    PoseSelection selection;
    for (int i = 0; i < options_.poses; ++i) {
      if (progress) progress(i + 1);
      const bool both = i % both_arms_every == both_arms_every - 1;
      auto pose = both ? move_both() : move_one();
      if (!pose) continue;
      learn(pose->joints);
      here_ = pose->joints;
      selection.poses.push_back(std::move(*pose));
    }
    if (static_cast<int>(selection.poses.size()) < min_poses) {
      throw InputError("found " + std::to_string(selection.poses.size()) +
                       " poses that the arms reach with the target in view, expected at least " +
                       std::to_string(min_poses));
    }
    for (const FrozenArm frozen : {FrozenArm::replica, FrozenArm::sensor}) {
      if (auto stroke = find_stroke(frozen, fast_speed)) selection.strokes.push_back(*stroke);
    }
    for (const CalibrationJacobian& jacobian : workspace_) {
      const Matrix6d error = jacobian * covariance_ * jacobian.transpose();
      selection.expected_position += error.topLeftCorner<3, 3>().trace() / workspace_samples;
      selection.expected_rotation += error.bottomRightCorner<3, 3>().trace() / workspace_samples;
    }
    selection.expected_position = std::sqrt(selection.expected_position);
    selection.expected_rotation = std::sqrt(selection.expected_rotation);
    return selection;
  }

 private:
  bool in_view(const Pose& relative, double wider = 1) const {
    const Vector3d& p = relative.position;
    const double range = p.norm();
    return range > view_.nearest && range < view_.farthest &&
           std::atan2(p.head<2>().norm(), p.z()) < wider * view_.half_angle &&
           relative.rotation.angularDistance(view_.attitude) < view_.turn;
  }

  /// Joints about home of the arms that move, the target in view.
  std::optional<ArmPair> draw(const ArmPair& from, bool replica, bool sensor) {
    for (int i = 0; i < max_draws; ++i) {
      ArmPair joints = from;
      if (replica) vary(cell_.replica, replica_reach, joints.replica);
      if (sensor) vary(cell_.sensor, sensor_reach, joints.sensor);
      if (!in_view(cell_.relative_pose(joints.replica, joints.sensor))) continue;
      if (!cell_.replica.kinematics->limit_violation(joints.replica).empty()) continue;
      if (!cell_.sensor.kinematics->limit_violation(joints.sensor).empty()) continue;
      return joints;
    }
    return std::nullopt;
  }

  void vary(const PlacedArm& arm, const Reach& reach, Joints& joints) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double most = i < 3 ? reach.shoulder : reach.wrist;
      joints[i] = arm.home[i] + random_.uniform(-most, most);
    }
  }

  /// Reduction of truth's uncertainty over the workspace by a measurement there.
  double gain(const ArmPair& joints) const {
    const CalibrationJacobian jacobian = calibration_jacobian(cell_, joints);
    const Eigen::Matrix<double, calibration_size, 6> spread = covariance_ * jacobian.transpose();
    const Matrix6d innovation = noise_ + jacobian * spread;
    const Matrix6d criterion = spread.transpose() * criterion_ * spread;
    return innovation.llt().solve(criterion).trace();
  }

  void learn(const ArmPair& joints) {
    const CalibrationJacobian jacobian = calibration_jacobian(cell_, joints);
    const Eigen::Matrix<double, calibration_size, 6> spread = covariance_ * jacobian.transpose();
    const Matrix6d innovation = noise_ + jacobian * spread;
    covariance_ -= spread * innovation.llt().solve(spread.transpose());
  }

  std::optional<MotionPlanner::Plan> plan(const Pose& from, const Pose& to, FrozenArm frozen,
                                          const ArmPair& start,
                                          const RelativeLimits& limits) const {
    auto result =
        planner_.plan(std::make_shared<const StraightPath>(from, to, limits), start, frozen);
    if (auto* plan = std::get_if<MotionPlanner::Plan>(&result)) return std::move(*plan);
    return std::nullopt;
  }

  /// Where a planned motion ends.
  static std::optional<ArmPair> end_of(const ArmMotion& motion, const ArmPair& start) {
    constexpr int steps = 50;
    ArmPair joints = start;
    for (int i = 1; i <= steps; ++i) {
      const auto next = motion.at(motion.duration() * i / steps, joints, nullptr);
      if (!next) return std::nullopt;
      joints = *next;
    }
    return joints;
  }

  std::optional<CalibrationPose> go(const Pose& goal, FrozenArm frozen) const {
    const Pose from = cell_.relative_pose(here_.replica, here_.sensor);
    const auto way = plan(from, goal, frozen, here_, options_.limits);
    if (!way) return std::nullopt;
    const auto end = end_of(*way->motion, here_);
    if (!end) return std::nullopt;
    return CalibrationPose{goal, frozen, *end};
  }

  std::optional<CalibrationPose> move_one() {
    struct Candidate {
      double gain;
      ArmPair joints;
      FrozenArm frozen;
    };
    std::vector<Candidate> candidates;
    for (int i = 0; i < options_.candidates; ++i) {
      const bool replica = i % 2 == 0;
      const auto joints = draw(here_, replica, !replica);
      if (!joints) continue;
      candidates.push_back(
          {gain(*joints), *joints, replica ? FrozenArm::sensor : FrozenArm::replica});
    }
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.gain > b.gain; });
    int tries = 0;
    for (const Candidate& candidate : candidates) {
      if (++tries > max_plans) break;
      auto pose = go(cell_.relative_pose(candidate.joints.replica, candidate.joints.sensor),
                     candidate.frozen);
      if (pose) return pose;
    }
    return std::nullopt;
  }

  std::optional<CalibrationPose> move_both() {
    for (int i = 0; i < max_plans; ++i) {
      const auto joints = draw(here_, true, true);
      if (!joints) break;
      auto pose = go(cell_.relative_pose(joints->replica, joints->sensor), FrozenArm::none);
      if (pose) return pose;
    }
    return std::nullopt;
  }

  /// Where a stroke of this length may lead: along the line of sight, or across it as the sensor
  /// turns.
  Pose stroke_from(const Pose& from, double length, bool across) {
    Pose to = from;
    const double range = from.position.norm();
    if (!across) {
      const double sign = range > 0.5 * (view_.nearest + view_.farthest) ? -1 : 1;
      const Vector3d way(random_.uniform(-0.2, 0.2), random_.uniform(-0.2, 0.2), sign);
      to.position += length * way.normalized();
      return to;
    }
    const Vector3d side = -Vector3d(from.position.x(), from.position.y(), 0).normalized();
    const Vector3d axis = Vector3d::UnitZ().cross(side);
    const Quaterniond turn = rotation_from_vector(2 * std::asin(0.5 * length / range) * axis);
    return {turn * from.position, turn * from.rotation};
  }

  /// Searches also over places to which the arm may move first.
  std::optional<FastStroke> find_stroke(FrozenArm frozen, double speed) {
    constexpr int tries = 600;
    RelativeLimits limits = options_.limits;
    limits.speed = 1.05 * speed;
    // length of the ramps to full speed and back
    const double min_length =
        limits.speed * limits.speed / limits.acceleration + limits.speed * limits.rise_time;
    for (int i = 0; i < tries; ++i) {
      // the longest possible: time offsets are observable at steady speed
      const double length = min_length * (1.6 - 0.5 * i / tries);
      const bool replica = frozen == FrozenArm::sensor;
      const auto joints = draw(here_, replica, !replica);
      if (!joints) continue;
      const Pose from = cell_.relative_pose(joints->replica, joints->sensor);
      const Pose to = stroke_from(from, length, i % 2 == 1);
      if (!in_view(to, 1.25)) continue;
      const auto start = go(from, frozen);
      if (!start) continue;
      const auto stroke = plan(from, to, frozen, start->joints, limits);
      if (!stroke) continue;
      const auto end = end_of(*stroke->motion, start->joints);
      if (!end || !plan(to, from, frozen, *end, limits)) continue;
      here_ = start->joints;  // an even number of strokes leads back
      return FastStroke{from, to, frozen, limits.speed};
    }
    return std::nullopt;
  }

  const Cell& cell_;
  const MotionPlanner& planner_;
  CalibrationView view_;
  SelectionOptions options_;
  Random random_;
  MatrixXd covariance_;
  MatrixXd criterion_;
  Matrix6d noise_;
  Matrix6d weight_;
  std::vector<CalibrationJacobian> workspace_;
  ArmPair here_;
};

}  // namespace

CalibrationView calibration_view(const Cell& cell, const LidarProfile& profile) {
  double radius = 0;
  for (const Vector3d& vertex : cell.target.mesh.vertices) {
    radius = std::max(radius, vertex.norm());
  }
  CalibrationView view;
  // Share of the target that must be within range and field of view.
  constexpr double share = 0.8;
  const double field = std::min(profile.field_of_view_width, profile.field_of_view_height);
  view.nearest = profile.beam.range_min_m + share * radius;
  view.farthest = std::max(2 * view.nearest, 8 * radius / std::tan(0.5 * field) / 4);
  view.half_angle = 0.2 * field;
  view.attitude = cell.relative_pose(cell.replica.home, cell.sensor.home).rotation;
  view.turn = radians(40);
  return view;
}

PoseSelection select_poses(const Cell& cell, const MotionPlanner& planner,
                           const CalibrationView& view, const MatrixXd& prior, double fast_speed,
                           const SelectionOptions& options,
                           const std::function<void(int)>& progress) {
  return Selector(cell, planner, view, prior, options).select(fast_speed, progress);
}

}  // namespace berth::testbed
