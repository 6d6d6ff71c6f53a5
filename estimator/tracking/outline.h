// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "estimator/tracking/beam_selection.h"

namespace berth::estimator {

/// The field of view in cells, of which some have seen returns.
class ReturnImage {
 public:
  explicit ReturnImage(const std::vector<Vector3d>& returns);

  /// Whether its cell or one beside it has seen a return.
  bool near(const Beam& beam) const;

 private:
  static constexpr int side = 128;
  static std::size_t index(const Eigen::Vector2f& at);
  void spread(std::size_t distance);

  Eigen::Vector2f low_ = Eigen::Vector2f::Zero();
  float per_cell_ = 1;
  std::array<std::uint8_t, static_cast<std::size_t>(side) * side> marked_{};
};

/// Beams without a return that passed close to some: they tell where the target ends. Most of a
/// scan's are not asked for.
class Outline {
 public:
  /// The scan must outlive it.
  explicit Outline(const CleanScan& scan) : beams_(scan.beams), image_(scan.points) {}

  /// In their order.
  BeamPicks all() const;
  /// Those of a group (beam_groups.h).
  BeamPicks group(int group, int groups) const;

 private:
  bool holds(std::uint32_t beam) const { return !beams_[beam].hit() && image_.near(beams_[beam]); }

  const std::vector<Beam>& beams_;
  ReturnImage image_;
};

}  // namespace berth::estimator
