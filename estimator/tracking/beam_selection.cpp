// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_selection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

namespace berth::estimator {

namespace {

/// The field of view in cells, of which some have seen returns.
class ReturnImage {
 public:
  explicit ReturnImage(const std::vector<Vector3d>& returns) {
    if (returns.empty()) return;
    std::vector<Eigen::Vector2f> images;
    images.reserve(returns.size());
    for (const Vector3d& point : returns) images.push_back(image_of(point));
    Eigen::Vector2f low = images.front();
    Eigen::Vector2f high = low;
    for (const Eigen::Vector2f& image : images) {
      low = low.cwiseMin(image);
      high = high.cwiseMax(image);
    }
    // About one return in a cell, were they spread evenly.
    const Eigen::Vector2f extent = high - low;
    const float spacing = std::sqrt(std::max(extent.prod(), 1e-9F * extent.squaredNorm()) /
                                    static_cast<float>(returns.size()));
    const float least = extent.maxCoeff() / (side - 5);
    const float cell = std::max({1.5F * spacing, least, 1e-9F});
    per_cell_ = 1 / cell;
    low_ = low.array() - 2.5F * cell;  // what is near a return has a neighbour on every side
    for (const Eigen::Vector2f& image : images) marked_[index((image - low_) * per_cell_)] = 1;
    spread(1);
    spread(side);
  }

  /// Whether its cell or one beside it has seen a return.
  bool near(const Beam& beam) const {
    const Eigen::Vector2f at = (image_of(beam.direction) - low_) * per_cell_;
    return marked_[index(at.cwiseMax(0).cwiseMin(side - 1))] != 0;  // nothing is near the rim
  }

 private:
  static constexpr int side = 128;

  static Eigen::Vector2f image_of(const Vector3d& along) {
    const Eigen::Vector3f d = along.cast<float>();
    return d.head<2>() * (1 / std::max(d.z(), 1e-3F));
  }
  static std::size_t index(const Eigen::Vector2f& at) {
    const int row = static_cast<int>(at.y());
    const int column = static_cast<int>(at.x());
    return static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column);
  }

  /// To the cells before and after.
  void spread(std::size_t distance) {
    const auto from = marked_;
    for (std::size_t i = distance; i + distance < marked_.size(); ++i) {
      marked_[i] = from[i - distance] | from[i] | from[i + distance];
    }
  }

  Eigen::Vector2f low_ = Eigen::Vector2f::Zero();
  float per_cell_ = 1;
  std::array<std::uint8_t, static_cast<std::size_t>(side) * side> marked_{};
};

/// Of each of some that stand for all.
double weight_of(const BeamPicks& some, std::size_t all) {
  return some.empty() ? 1 : static_cast<double>(all) / static_cast<double>(some.size());
}

}  // namespace

BeamPicks evenly(const BeamPicks& from, std::size_t most) {
  const std::size_t stride = 1 + from.size() / (most + 1);
  BeamPicks picks;
  picks.reserve(from.size() / stride + 1);
  for (std::size_t i = 0; i < from.size(); i += stride) picks.push_back(from[i]);
  return picks;
}

BeamSample sample(const BeamPicks& from, std::size_t most) {
  BeamPicks picks = evenly(from, most);
  const double weight = weight_of(picks, from.size());
  return {std::move(picks), weight};
}

BeamPicks evenly(std::size_t count, std::size_t most) {
  const std::size_t stride = 1 + count / (most + 1);
  BeamPicks picks;
  picks.reserve(count / stride + 1);
  for (std::size_t i = 0; i < count; i += stride) picks.push_back(static_cast<std::uint32_t>(i));
  return picks;
}

BeamSelection select_beams(const CleanScan& scan, std::size_t few, std::size_t most_empty) {
  BeamSelection selection;
  selection.few = evenly(scan.beam_of_point, few);
  const ReturnImage image(scan.points);
  const std::span beams(scan.beams);
  selection.all.reserve(scan.points.size());
  const auto misses = static_cast<std::size_t>(scan.misses);
  const std::size_t stride = 1 + misses / (most_empty + 1);
  BeamPicks& empty = selection.empty.picks;
  std::size_t until_next = 1;
  for (std::uint32_t i = 0; i < beams.size(); ++i) {
    if (beams[i].hit()) {
      selection.all.push_back(i);
      continue;
    }
    if (image.near(beams[i])) selection.outline.push_back(i);
    if (--until_next > 0) continue;
    empty.push_back(i);
    until_next = stride;
  }
  selection.empty.weight = weight_of(empty, misses);
  return selection;
}

}  // namespace berth::estimator
