// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "testbed/motion/path_check.h"
#include "testbed/motion/relative_path.h"

namespace berth::testbed {

enum class FrozenArm { none, replica, sensor };

/// How the redundancy of both arms is resolved: twelve joints serve the six degrees of freedom of a
/// relative motion. The sensor arm takes a share of the travel along and across the home line of
/// sight, the replica arm the rest. Also free are a displacement of both arms in the cell and a
/// rotation of the line of sight.
struct RedundancyResolution {
  double travel = 0.5;                ///< of the change of range, by the sensor arm
  double lateral = 0;                 ///< of the sideways change, by the sensor arm
  Vector3d shift = Vector3d::Zero();  ///< m, of both arms together, cell frame: at the end
  Vector3d bulge = Vector3d::Zero();  ///< m, additional, half way
  Vector3d turn = Vector3d::Zero();   ///< rad, of both about the middle between them: at the end
};

/// Turns relative poses T_sensor_model into joints of both arms, for one motion: it begins at the
/// joints where the motion starts and goes over smoothly to the chosen redundancy resolution as the
/// motion progresses.
class ArmAllocation {
 public:
  ArmAllocation(const Cell& cell, const RedundancyResolution& resolution, FrozenArm frozen,
                const ArmPair& start);

  /// progress: 0 at the start of the motion, 1 at its end. near: the joints just before; the branch
  /// nearest to them is taken. Nothing when the pose is infeasible; reason then names arm and
  /// cause.
  std::optional<ArmPair> joints(const Pose& relative, double progress, const ArmPair& near,
                                std::string* reason) const;

 private:
  Pose nominal_sensor(const Pose& relative, double progress) const;

  const Cell* cell_;
  RedundancyResolution resolution_;
  FrozenArm frozen_;
  ArmPair start_;
  Pose start_sensor_;   // T_cell_sensor
  Pose start_replica_;  // T_cell_model
  Pose home_sensor_;
  Vector3d middle_;  // between sensor and replica at home, cell frame
  Pose home_relative_;
  Vector6d correction_ = Vector6d::Zero();  // from the nominal sensor pose to the one at the start
};

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

/// The inverse solution nearest to the given joints, whole turns counted.
std::optional<Joints> nearest_solution(const ArmKinematics& arm, const Pose& flange,
                                       const Joints& near, std::string* reason);

}  // namespace berth::testbed
