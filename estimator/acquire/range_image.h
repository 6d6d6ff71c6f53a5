// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/mesh.h"
#include "estimator/beam/scan.h"

namespace berth::estimator {

/// A scan as an image: pixels about as large as the beams' spacing, on the plane normal to the mean
/// direction of its returns. Beams farther than 75 degrees from that direction are left out; of
/// many beams in a pixel a few are kept. Results are independent of the order of beams.
class RangeImage {
 public:
  static constexpr double missed = std::numeric_limits<double>::infinity();

  /// beam_model: the scanner's specification.
  RangeImage(const PreprocessedScan& scan, const BeamModel& beam_model);

  /// Row by row.
  const std::vector<Beam>& beams() const { return beams_; }
  /// Background density of each beam: log of the probability density (1/m) of its range, or of the
  /// probability of no return, on a smooth surface. Predicted by its neighbours without the beam
  /// itself: by planes and lines through them in inverse range (exact on planes), by copies of
  /// them, and by a uniform component.
  const std::vector<double>& log_background() const { return log_background_; }
  /// The beam model, its sigmas times the noise scale.
  const BeamModel& noise() const { return noise_; }
  /// Scatter of ranges about lines through their neighbours over the specification; at least 1:
  /// noise that neighbours share does not show.
  double noise_scale() const { return noise_scale_; }
  double spacing() const { return spacing_; }  ///< rad, between beams: the mean of both axes
  double solid_angle() const { return solid_angle_; }  ///< sr, scanned
  double nearest() const { return nearest_; }          ///< m, of the returns
  double farthest() const { return farthest_; }        ///< m
  /// m, over which ranges are uniform.
  double depth() const { return std::max(1.0, farthest_ - nearest_); }

  /// From the sensor's axes to the image's: across, down, along its mean direction.
  Matrix3d axes() const {
    Matrix3d rows;
    rows << across_.transpose(), down_.transpose(), axis_.transpose();
    return rows;
  }
  /// Pixel of a point in the image's axes; -1 outside.
  int pixel(float across, float down, float along) const {
    if (along <= 0) return -1;
    const float x =
        (across / along - static_cast<float>(left_)) * static_cast<float>(columns_per_unit_);
    const float y = (down / along - static_cast<float>(top_)) * static_cast<float>(rows_per_unit_);
    const bool inside =
        x >= 0 && y >= 0 && x < static_cast<float>(width_) && y < static_cast<float>(height_);
    return inside ? static_cast<int>(x) + width_ * static_cast<int>(y) : -1;
  }
  /// rad, between rows or columns: the larger.
  double widest_spacing() const { return 1 / std::min(columns_per_unit_, rows_per_unit_); }
  int width() const { return width_; }
  int height() const { return height_; }
  struct Span {
    std::size_t from, to;
  };
  Span beams_at(int pixel) const {
    const auto at = static_cast<std::size_t>(pixel);
    return {first_from_[at], first_from_[at + 1]};
  }
  /// The pixel's first beam; -1: not scanned.
  int beam_at(int pixel) const { return beam_at_[static_cast<std::size_t>(pixel)]; }
  int pixel_of(int beam) const { return pixel_of_[static_cast<std::size_t>(beam)]; }
  /// Spacing of neighbouring beams, in pixels: 1, more in the sparser windows of a scan of several
  /// windows.
  int pixels_apart(int beam) const { return pixels_apart_[static_cast<std::size_t>(beam)]; }
  /// Ranges of beams, one per row, that cover the projection of a box.
  void spans_of(const Box& box, const Pose& pose, std::vector<Span>& spans) const;
  /// m, of the pixel and its eight neighbours. Not scanned: nearest is infinite, farthest 0.
  float nearest_about(int pixel) const { return nearest_about_[static_cast<std::size_t>(pixel)]; }
  float farthest_about(int pixel) const { return farthest_about_[static_cast<std::size_t>(pixel)]; }

 private:
  const Beam* neighbour(const Beam* beam, int dx, int dy) const;
  double incidence(const Beam& beam) const;
  void rasterise(const PreprocessedScan& scan);
  void measure_spacing();
  void estimate_noise();
  void estimate_background();

  std::vector<Beam> beams_;
  std::vector<double> log_background_;
  BeamModel noise_;
  double noise_scale_ = 1;
  Vector3d axis_ = Vector3d::UnitZ();
  Vector3d across_ = Vector3d::UnitX();
  Vector3d down_ = Vector3d::UnitY();
  double left_ = 0, top_ = 0, columns_per_unit_ = 1, rows_per_unit_ = 1, spacing_ = 1,
         solid_angle_ = 0;
  double nearest_ = 0, farthest_ = 0;
  int width_ = 0, height_ = 0;
  std::vector<int> beam_at_, pixel_of_, pixels_apart_;
  std::vector<std::size_t> first_from_;  // of each pixel, the first beam there or after
  std::vector<float> nearest_about_, farthest_about_;
};

}  // namespace berth::estimator
