// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_selection.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace berth::estimator {

namespace {

BeamPicks evenly(const BeamPicks& from, std::size_t most) {
  const std::size_t stride = 1 + from.size() / (most + 1);
  BeamPicks picks;
  picks.reserve(from.size() / stride + 1);
  for (std::size_t i = 0; i < from.size(); i += stride) picks.push_back(from[i]);
  return picks;
}

/// The field of view in cells, of which some have seen returns.
class ReturnImage {
 public:
  ReturnImage(const std::vector<Beam>& beams, const BeamPicks& returns) {
    if (returns.empty()) return;
    Eigen::Vector2d low = image_of(beams[returns.front()]);
    Eigen::Vector2d high = low;
    for (const std::uint32_t i : returns) {
      low = low.cwiseMin(image_of(beams[i]));
      high = high.cwiseMax(image_of(beams[i]));
    }
    // About one return in a cell, were they spread evenly.
    const Eigen::Vector2d extent = high - low;
    const double spacing = std::sqrt(std::max(extent.prod(), 1e-9 * extent.squaredNorm()) /
                                     static_cast<double>(returns.size()));
    const double least = extent.maxCoeff() / (side - 3);
    cell_ = std::max({1.5 * spacing, least, 1e-9});
    low_ = low.array() - cell_;
    for (const std::uint32_t i : returns) mark(image_of(beams[i]));
  }

  /// Whether its cell or one beside it has seen a return.
  bool near(const Beam& beam) const {
    const Eigen::Vector2d at = (image_of(beam) - low_) / cell_;
    if (!(at.minCoeff() >= 0 && at.maxCoeff() < side)) return false;
    return marked_[index(static_cast<int>(at.x()), static_cast<int>(at.y()))];
  }

 private:
  static constexpr int side = 128;

  static Eigen::Vector2d image_of(const Beam& beam) {
    const double forward = std::max(beam.direction.z(), 1e-3);
    return {beam.direction.x() / forward, beam.direction.y() / forward};
  }
  static std::size_t index(int x, int y) { return static_cast<std::size_t>(y * side + x); }

  void mark(const Eigen::Vector2d& image) {
    const Eigen::Vector2d at = (image - low_) / cell_;
    for (int y = static_cast<int>(at.y()) - 1; y <= static_cast<int>(at.y()) + 1; ++y) {
      for (int x = static_cast<int>(at.x()) - 1; x <= static_cast<int>(at.x()) + 1; ++x) {
        if (x >= 0 && y >= 0 && x < side && y < side) marked_[index(x, y)] = true;
      }
    }
  }

  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double cell_ = 1;
  std::array<bool, side * side> marked_{};
};

}  // namespace

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
  selection.some = evenly(scan.beam_of_point, 10 * few);
  BeamPicks empty;
  selection.all.reserve(scan.points.size());
  empty.reserve(scan.beams.size() - scan.points.size());
  for (std::size_t i = 0; i < scan.beams.size(); ++i) {
    (scan.beams[i].hit() ? selection.all : empty).push_back(static_cast<std::uint32_t>(i));
  }
  selection.empty = sample(empty, most_empty);
  return selection;
}

OutlineSelection select_outline(const CleanScan& scan, std::size_t few) {
  OutlineSelection selection;
  const ReturnImage image(scan.beams, scan.beam_of_point);
  for (std::size_t i = 0; i < scan.beams.size(); ++i) {
    const auto beam = static_cast<std::uint32_t>(i);
    const bool hit = scan.beams[i].hit();
    if (!hit && !image.near(scan.beams[i])) continue;
    selection.all.push_back(beam);
    if (!hit) selection.outline.push_back(beam);
  }
  selection.few = evenly(selection.all, few);
  return selection;
}

}  // namespace berth::estimator
