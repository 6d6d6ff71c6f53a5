// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <vector>

#include "estimator/model/target_model.h"
#include "estimator/published/icp.h"

namespace berth::estimator {

struct BoundedHoughOptions {
  double voxel = 0.02;  ///< of the coarsest level, of the target's length; each next one is half
  int levels = 3;
  int reach = 2;         ///< cells to either side of the expected pose, on the coarsest level
  int kept = 32;         ///< cells that the next level divides
  int max_points = 300;  ///< that vote; more are thinned
};

/// The Bounded Hough Transform (Greenspan, Shang, Jasiobedzki, "Efficient tracking with the Bounded
/// Hough Transform", CVPR 2004), the paper's reference 9. Between two frames the pose can only move
/// a little: that bounded part of the six-dimensional pose space is cut into cells of about one
/// voxel, and every return votes for each cell whose motion carries it into a voxel that the model
/// occupies. Here the cells are counted from coarse to fine, where the published method has one
/// resolution and a table of the votes of each voxel.
class BoundedHough {
 public:
  BoundedHough(const TargetModel& model, const BoundedHoughOptions& options);

  struct Result {
    Pose pose;       ///< T_sensor_model: the middle of the cells with the most votes
    int votes = 0;   ///< of the best cell
    int voters = 0;  ///< returns that could have voted
  };
  /// points: sensor frame, m; expected: the pose about which is searched.
  Result vote(const std::vector<Vector3d>& points, const Pose& expected) const;

  /// How far from the expected pose a cell can be, along each axis: m and rad.
  double bound_m() const { return options_.reach * levels_.front().voxel; }
  double bound_rad() const { return bound_m() / lever_; }

 private:
  /// Voxels that the visible surface touches, one byte each, with room to shift them at the rim.
  struct Level {
    double voxel = 0;  // m; a cell's step in translation, and over the lever in rotation
    Vector3d low = Vector3d::Zero();
    std::array<int, 3> size{};
    std::vector<std::uint8_t> occupied;

    /// Of the voxel that holds a point of the model frame; -1 where a shift might leave the grid.
    std::int64_t index(const Vector3d& point, int margin) const;
  };
  struct Cell {
    Vector3d shift = Vector3d::Zero();  // of the returns, model frame, m
    Vector3d turn = Vector3d::Zero();   // rotation vector about the model's centre
    int votes = 0;
  };

  Level make_level(double voxel) const;
  std::vector<Cell> count(const Level& level, const std::vector<Vector3d>& points,
                          const std::vector<Cell>& around, int reach) const;

  const TargetModel& model_;
  BoundedHoughOptions options_;
  double lever_ = 1;  // m that a rotation moves the surface by, per radian
  std::vector<Level> levels_;
};

/// Tracking by votes: the Bounded Hough Transform finds the pose to about half of its finest voxel,
/// point registration from there refines and judges it.
class BoundedHoughTracking final : public Tracking {
 public:
  BoundedHoughTracking(const TargetModel& model, const BeamModel& beam_model,
                       const BoundedHoughOptions& options, const IcpTrackingOptions& refinement)
      : hough_(model, options), refinement_(model, beam_model, refinement) {}

  std::string name() const override { return "bounded_hough"; }
  TrackingResult track(const CleanScan& scan, const Prediction& predicted) const override;

 private:
  BoundedHough hough_;
  IcpTracking refinement_;
};

}  // namespace berth::estimator
