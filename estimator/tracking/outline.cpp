// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/outline.h"

#include <algorithm>
#include <cmath>

#include "estimator/tracking/beam_groups.h"

namespace berth::estimator {

namespace {

Eigen::Vector2f image_of(const Vector3d& along) {
  const Eigen::Vector3f d = along.cast<float>();
  return d.head<2>() * (1 / std::max(d.z(), 1e-3F));
}

}  // namespace

ReturnImage::ReturnImage(const std::vector<Vector3d>& returns) {
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

bool ReturnImage::near(const Beam& beam) const {
  const Eigen::Vector2f at = (image_of(beam.direction) - low_) * per_cell_;
  return marked_[index(at.cwiseMax(0).cwiseMin(side - 1))] != 0;  // nothing is near the rim
}

std::size_t ReturnImage::index(const Eigen::Vector2f& at) {
  const int row = static_cast<int>(at.y());
  const int column = static_cast<int>(at.x());
  return static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column);
}

/// To the cells before and after.
void ReturnImage::spread(std::size_t distance) {
  const auto from = marked_;
  for (std::size_t i = distance; i + distance < marked_.size(); ++i) {
    marked_[i] = from[i - distance] | from[i] | from[i + distance];
  }
}

BeamPicks Outline::all() const {
  BeamPicks picks;
  for (std::uint32_t i = 0; i < beams_.size(); ++i) {
    if (holds(i)) picks.push_back(i);
  }
  return picks;
}

BeamPicks Outline::group(int group, int groups) const {
  BeamPicks picks;
  for_each_in_group(static_cast<std::uint32_t>(beams_.size()), group, groups,
                    [&](std::uint32_t beam) { picks.push_back(beam); });
  // They lie far apart: asked of memory before they are looked at.
  constexpr std::size_t ahead = 16;
  std::size_t held = 0;
  for (std::size_t i = 0; i < picks.size(); ++i) {
    __builtin_prefetch(&beams_[picks[std::min(i + ahead, picks.size() - 1)]].range);
    if (holds(picks[i])) picks[held++] = picks[i];
  }
  picks.resize(held);
  return picks;
}

}  // namespace berth::estimator
