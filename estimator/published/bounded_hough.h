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
  int kept = 32;         ///< cells that the next level subdivides
  int max_points = 300;  ///< voters; more are thinned
};

/// The Bounded Hough Transform (Greenspan, Shang, Jasiobedzki, "Efficient tracking with the Bounded
/// Hough Transform", CVPR 2004; the paper's reference 9). Between two frames the pose moves little:
/// that bounded part of the six-dimensional pose space is divided into cells of about one voxel,
/// and every return votes for each cell whose motion maps it into an occupied voxel of the model.
/// Here cells are counted from coarse to fine; the published method has one resolution and a table
/// of the votes of each voxel.
class BoundedHough {
 public:
  BoundedHough(const TargetModel& model, const BoundedHoughOptions& options);

  struct Result {
    Pose pose;       ///< T_sensor_model: the middle of the cells with the most votes
    int votes = 0;   ///< of the best cell
    int voters = 0;  ///< returns inside the grid
  };
  /// points: sensor frame, m; expected: the centre of the search.
  Result vote(const std::vector<Vector3d>& points, const Pose& expected) const;

  /// Bounds of the search about the expected pose, along each axis: m and rad.
  double bound_m() const { return options_.reach * levels_.front().voxel; }
  double bound_rad() const { return bound_m() / lever_; }

 private:
  /// Voxels touched by the visible surface, one byte each, padded for shifts.
  struct Level {
    double voxel = 0;  // m; a cell's step in translation, and over the lever in rotation
    Vector3d low = Vector3d::Zero();
    std::array<int, 3> size{};
    std::vector<std::uint8_t> occupied;

    /// Voxel of a point of the model frame; -1 where a shift might leave the grid.
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

/// Tracking by the Bounded Hough Transform, refined and validated by ICP.
class BoundedHoughTracking final : public Tracking {
 public:
  BoundedHoughTracking(const TargetModel& model, const BeamModel& beam_model,
                       const BoundedHoughOptions& options, const IcpTrackingOptions& refinement)
      : hough_(model, options), refinement_(model, beam_model, refinement) {}

  std::string name() const override { return "bounded_hough"; }
  TrackingResult track(const PreprocessedScan& scan, const Prediction& predicted) const override;

 private:
  BoundedHough hough_;
  IcpTracking refinement_;
};

}  // namespace berth::estimator
