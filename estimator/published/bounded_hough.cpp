// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/bounded_hough.h"

#include <algorithm>
#include <cmath>

#include "estimator/beam/scan.h"

namespace berth::estimator {
namespace {

int cube(int n) { return n * n * n; }

}  // namespace

BoundedHough::BoundedHough(const TargetModel& model, const BoundedHoughOptions& options)
    : model_(model), options_(options) {
  double sum = 0;
  for (const SurfaceSample& s : model.surface.samples) {
    sum += (s.position.cast<double>() - model.centre).squaredNorm();
  }
  lever_ = std::sqrt(sum / static_cast<double>(model.surface.samples.size()));
  const double length = bounding_box(model.target.mesh).size().maxCoeff();
  double voxel = options.voxel * length;
  for (int i = 0; i < options.levels; ++i, voxel /= 2) levels_.push_back(make_level(voxel));
}

BoundedHough::Level BoundedHough::make_level(double voxel) const {
  Level level;
  level.voxel = voxel;
  const Box box = bounding_box(model_.target.mesh);
  const int margin = options_.reach + 2;
  for (int i = 0; i < 3; ++i) {
    level.low[i] = box.low[i] - margin * voxel;
    level.size[static_cast<std::size_t>(i)] =
        static_cast<int>(std::ceil(box.size()[i] / voxel)) + 2 * margin;
  }
  const auto [nx, ny, nz] = level.size;
  level.occupied.assign(
      static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz),
      0);
  // A surface nearer to the centre than half an edge passes through the voxel.
  ClosestPointGrid::Match match;
  std::size_t i = 0;
  for (int z = 0; z < nz; ++z) {
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x, ++i) {
        const Vector3d centre = level.low + voxel * Vector3d(x + 0.5, y + 0.5, z + 0.5);
        if (!model_.grid.stored(centre, match)) continue;
        if ((match.point - centre).norm() > voxel + model_.grid.cell()) continue;
        model_.grid.refined(centre, match);
        level.occupied[i] = (match.point - centre).lpNorm<Eigen::Infinity>() <= 0.5 * voxel;
      }
    }
  }
  return level;
}

std::int64_t BoundedHough::Level::index(const Vector3d& point, int margin) const {
  const Vector3d p = (point - low) / voxel;
  std::int64_t result = 0;
  for (int i = 2; i >= 0; --i) {
    const int n = size[static_cast<std::size_t>(i)];
    if (!(p[i] >= margin && p[i] < n - margin)) return -1;
    result = result * n + static_cast<std::int64_t>(p[i]);
  }
  return result;
}

std::vector<BoundedHough::Cell> BoundedHough::count(const Level& level,
                                                    const std::vector<Vector3d>& points,
                                                    const std::vector<Cell>& around,
                                                    int reach) const {
  const int width = 2 * reach + 1;
  std::vector<std::int64_t> offsets;  // of the shifted voxel
  std::vector<Vector3d> steps;
  for (int z = -reach; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        steps.emplace_back(x, y, z);
        offsets.push_back(x + static_cast<std::int64_t>(level.size[0]) *
                                  (y + static_cast<std::int64_t>(level.size[1]) * z));
      }
    }
  }
  std::vector<Cell> cells;
  cells.reserve(around.size() * static_cast<std::size_t>(cube(width) * cube(width)));
  std::vector<int> votes(offsets.size());
  for (const Cell& parent : around) {
    for (const Vector3d& turn : steps) {
      const Vector3d r = parent.turn + level.voxel / lever_ * turn;
      const Matrix3d rotation = rotation_from_vector(r).toRotationMatrix();
      const Vector3d origin = model_.centre + parent.shift;
      std::fill(votes.begin(), votes.end(), 0);
      for (const Vector3d& p : points) {
        const std::int64_t at = level.index(rotation * p + origin, reach);
        if (at < 0) continue;
        const std::uint8_t* voxel = level.occupied.data() + at;
        for (std::size_t k = 0; k < offsets.size(); ++k) votes[k] += voxel[offsets[k]];
      }
      for (std::size_t k = 0; k < offsets.size(); ++k) {
        cells.push_back({parent.shift + level.voxel * steps[k], r, votes[k]});
      }
    }
  }
  return cells;
}

BoundedHough::Result BoundedHough::vote(const std::vector<Vector3d>& points,
                                        const Pose& expected) const {
  Result result;
  result.pose = expected;
  const Pose to_model = expected.inverse();
  const auto max_voters = static_cast<std::size_t>(options_.max_points);
  const std::size_t stride =
      std::max<std::size_t>(1, (points.size() + max_voters - 1) / max_voters);
  std::vector<Vector3d> voters;  // model frame, from its centre
  for (std::size_t i = 0; i < points.size(); i += stride) {
    const Vector3d p = to_model * points[i];
    if (levels_.front().index(p, 0) >= 0) voters.push_back(p - model_.centre);
  }
  result.voters = static_cast<int>(voters.size());
  if (voters.empty()) return result;

  // The most votes first; of equals the smaller motion.
  const auto better = [this](const Cell& a, const Cell& b) {
    if (a.votes != b.votes) return a.votes > b.votes;
    return a.shift.squaredNorm() + lever_ * lever_ * a.turn.squaredNorm() <
           b.shift.squaredNorm() + lever_ * lever_ * b.turn.squaredNorm();
  };
  std::vector<Cell> best(1);
  std::vector<Cell> cells;
  for (std::size_t i = 0; i < levels_.size(); ++i) {
    cells = count(levels_[i], voters, best, i == 0 ? options_.reach : 1);
    const auto kept = std::min(cells.size(), static_cast<std::size_t>(std::max(1, options_.kept)));
    std::partial_sort(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(kept), cells.end(),
                      better);
    best.assign(cells.begin(), cells.begin() + static_cast<std::ptrdiff_t>(kept));
  }
  result.votes = best.front().votes;

  // Interpolation: the weighted mean of cells near the best one with nearly as many votes.
  const double reach = 2.5 * levels_.back().voxel;
  const int min_votes = result.votes - 1 - result.votes / 50;
  Vector3d shift = Vector3d::Zero();
  Vector3d turn = Vector3d::Zero();
  double sum = 0;
  for (const Cell& c : cells) {
    if (c.votes <= min_votes || (c.shift - best.front().shift).norm() > reach ||
        lever_ * (c.turn - best.front().turn).norm() > reach) {
      continue;
    }
    const double weight = c.votes - min_votes;
    shift += weight * c.shift;
    turn += weight * c.turn;
    sum += weight;
  }
  shift /= sum;
  turn /= sum;
  // The motion is of the returns in the model frame; the model moves inversely.
  const Quaterniond q = rotation_from_vector(turn);
  const Pose motion{model_.centre + shift - q * model_.centre, q};
  result.pose = expected * motion.inverse();
  return result;
}

TrackingResult BoundedHoughTracking::track(const PreprocessedScan& scan,
                                           const Prediction& predicted) const {
  Prediction voted = predicted;
  const PreprocessedScan still = at_mean_time(scan, predicted.velocity, predicted.pose.position);
  voted.pose = hough_.vote(still.points, predicted.pose).pose;
  return refinement_.track(scan, voted);
}

}  // namespace berth::estimator
