// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "estimator/model/lanes.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// The target as it is seen from about one place, in cells: an item buffer (Weghorst, Hooper and
/// Greenberg 1984). A cell names a triangle where nothing else can come before the plane of that
/// one: a beam through it that meets the plane within the triangle meets it first, and needs no
/// cast. Built anew for each view: it pays where beams are many more than triangles.
class FaceImage {
 public:
  struct View {
    Vector3d eye = Vector3d::Zero();  ///< model frame, m
    double sway = 0;                  ///< m; beams come from at most so far beside it
    double reach = 0;                 ///< rad; so near to a beam, nothing else comes before it
  };
  static constexpr std::int32_t unknown = -1;
  /// m, along a beam: where it returned from and where it meets the plane must be so near, else it
  /// was looked up in the wrong cell. Without sway it does not matter.
  static constexpr double slack_m = 0.1;

  /// cells: along the longer side. Seen from too near, all is unknown.
  FaceImage(const TargetModel& model, const View& view, int cells);

  const View& view() const { return view_; }

  /// Of each of four points (model frame, m) the triangle that is the foremost where it is seen, or
  /// unknown.
  std::array<std::int32_t, 4> foremost(const Four3& points) const {
    const Four3 to = points - eye_;
    const Four scale = per_cell_ / ahead_.dot(to);
    const Four column = right_.dot(to) * scale - left_;
    const Four row = down_.dot(to) * scale - top_;
    // What is no number is outside; what lies behind the eye may not be, and is nowhere met.
    const FourFlags inside = (column >= 0) & (row >= 0) & (column < columns_) & (row < rows_);
    const Four cell = inside ? whole(row) * columns_ + whole(column) : outside_;
    alignas(16) std::array<std::int32_t, 4> cells;
    _mm_store_si128(reinterpret_cast<__m128i*>(cells.data()), _mm256_cvttpd_epi32(cell));
    return {triangles_[at(cells[0])], triangles_[at(cells[1])], triangles_[at(cells[2])],
            triangles_[at(cells[3])]};
  }

 private:
  class Painter;
  static Four whole(const Four& value) { return _mm256_floor_pd(value); }
  static std::size_t at(int cell) { return static_cast<std::size_t>(cell); }

  View view_;
  Four3 eye_{};
  Four3 right_{}, down_{}, ahead_{};  // axes
  Four per_cell_{}, left_{}, top_{};  // cells in a tangent of 1; of the image's corner
  Four columns_{}, rows_{};
  Four outside_{};                       // the last cell: it is none of the image
  std::vector<std::int32_t> triangles_;  // of the cells
};

}  // namespace berth::estimator
