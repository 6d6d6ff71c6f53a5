// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "common/core/beam_model.h"
#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

/// A scan as an image: pixels about as wide and as high as beams are apart, on the plane square to
/// the mean direction of its returns. Beams farther than 75 degrees from that are left out. What is
/// computed from it does not depend on the order of beams.
class RangeImage {
 public:
  static constexpr double missed = std::numeric_limits<double>::infinity();

  /// beam_model: of the noise that neighbouring ranges have.
  RangeImage(const CleanScan& scan, const BeamModel& beam_model);

  /// Row by row.
  const std::vector<Beam>& beams() const { return beams_; }
  /// Of each beam, log of the probability density (1/m) of its range, or of the probability that
  /// nothing returns, if something smooth is there: as the beams about it say without it, by lines
  /// through neighbours, in inverse range (exact on planes), by copies of them, and a share of
  /// anywhere.
  const std::vector<double>& log_background() const { return log_background_; }
  double spacing() const { return spacing_; }  ///< rad, between beams: of both ways the mean
  double solid_angle() const { return solid_angle_; }  ///< sr, that was scanned
  double nearest() const { return nearest_; }          ///< m, of the returns
  double farthest() const { return farthest_; }        ///< m

  /// -1 outside. Place: sensor frame.
  int pixel(const Vector3d& place) const {
    const double depth = axis_.dot(place);
    if (depth <= 0.2 * place.norm()) return -1;
    const int x = static_cast<int>((across_.dot(place) / depth - left_) * columns_per_unit_);
    const int y = static_cast<int>((down_.dot(place) / depth - top_) * rows_per_unit_);
    return x < 0 || y < 0 || x >= width_ || y >= height_ ? -1 : x + width_ * y;
  }
  int width() const { return width_; }
  int height() const { return height_; }
  /// Of the pixel's first beam; -1: not scanned.
  int beam_at(int pixel) const { return beam_at_[static_cast<std::size_t>(pixel)]; }
  int pixel_of(int beam) const { return pixel_of_[static_cast<std::size_t>(beam)]; }
  /// m, in the pixel and its eight neighbours. Not scanned: nearest is infinite, farthest 0.
  float nearest_about(int pixel) const { return nearest_about_[static_cast<std::size_t>(pixel)]; }
  float farthest_about(int pixel) const { return farthest_about_[static_cast<std::size_t>(pixel)]; }

 private:
  int neighbour(int beam, int dx, int dy) const;
  void place(const CleanScan& scan);
  void weigh_background(const BeamModel& beam_model);

  std::vector<Beam> beams_;
  std::vector<double> log_background_;
  Vector3d axis_ = Vector3d::UnitZ();
  Vector3d across_ = Vector3d::UnitX();
  Vector3d down_ = Vector3d::UnitY();
  double left_ = 0, top_ = 0, columns_per_unit_ = 1, rows_per_unit_ = 1, spacing_ = 1,
         solid_angle_ = 0;
  double nearest_ = 0, farthest_ = 0;
  int width_ = 0, height_ = 0;
  std::vector<int> beam_at_, pixel_of_;
  std::vector<float> nearest_about_, farthest_about_;
};

}  // namespace berth::estimator
