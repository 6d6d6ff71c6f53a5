// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_selection.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace berth::estimator {

namespace {

/// The field of view in cells, of which some have seen returns.
class ReturnImage {
 public:
  ReturnImage(const std::vector<Beam>& beams, const BeamPicks& returns) {
    if (returns.empty()) return;
    std::vector<Eigen::Vector2f> images;
    images.reserve(returns.size());
    for (const std::uint32_t i : returns) images.push_back(image_of(beams[i]));
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
    const float least = extent.maxCoeff() / (side - 4);
    const float cell = std::max({1.5F * spacing, least, 1e-9F});
    per_cell_ = 1 / cell;
    low_ = low.array() - 1.5F * cell;  // what is marked has a neighbour on every side
    for (const Eigen::Vector2f& image : images) mark((image - low_) * per_cell_);
  }

  /// Whether its cell or one beside it has seen a return.
  bool near(const Beam& beam) const {
    const Eigen::Vector2f at = (image_of(beam) - low_) * per_cell_;
    return at.x() >= 0 && at.y() >= 0 && at.x() < side && at.y() < side && marked_[index(at)];
  }

 private:
  static constexpr int side = 128;

  static Eigen::Vector2f image_of(const Beam& beam) {
    const Eigen::Vector3f d = beam.direction.cast<float>();
    return d.head<2>() * (1 / std::max(d.z(), 1e-3F));
  }
  static std::size_t index(const Eigen::Vector2f& at) {
    const int row = static_cast<int>(at.y());
    const int column = static_cast<int>(at.x());
    return static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column);
  }

  void mark(const Eigen::Vector2f& at) {
    const std::size_t middle = index(at);
    for (std::size_t row = middle - side; row <= middle + side; row += side) {
      std::fill_n(marked_.begin() + static_cast<std::ptrdiff_t>(row) - 1, 3, true);
    }
  }

  Eigen::Vector2f low_ = Eigen::Vector2f::Zero();
  float per_cell_ = 1;
  std::array<bool, static_cast<std::size_t>(side) * side> marked_{};
};

}  // namespace

BeamPicks evenly(const BeamPicks& from, std::size_t most) {
  const std::size_t stride = 1 + from.size() / (most + 1);
  BeamPicks picks;
  picks.reserve(from.size() / stride + 1);
  for (std::size_t i = 0; i < from.size(); i += stride) picks.push_back(from[i]);
  return picks;
}

BeamSample sample(const BeamPicks& from, std::size_t most) {
  BeamSample sample{evenly(from, most), 1};
  if (!from.empty()) {
    sample.weight = static_cast<double>(from.size()) / static_cast<double>(sample.picks.size());
  }
  return sample;
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
  selection.all.reserve(scan.points.size());
  BeamPicks misses;
  misses.reserve(scan.beams.size() - scan.points.size());
  const ReturnImage image(scan.beams, scan.beam_of_point);
  for (std::size_t i = 0; i < scan.beams.size(); ++i) {
    const auto pick = static_cast<std::uint32_t>(i);
    if (scan.beams[i].hit()) {
      selection.all.push_back(pick);
    } else {
      misses.push_back(pick);
      if (image.near(scan.beams[i])) selection.outline.push_back(pick);
    }
  }
  selection.empty = sample(misses, most_empty);
  return selection;
}

}  // namespace berth::estimator
