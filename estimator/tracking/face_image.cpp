// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/face_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace berth::estimator {

namespace {

constexpr double rounding = 1e-6;      // rad, and of depths
constexpr double min_facing_cosine = 0.02;  // flatter faces are left to a cast
constexpr double widest = 1;           // tangent of half the image

/// Columns first to last - 1 of a row.
struct Span {
  int first, last;
};

/// A side of a triangle in the image: inside it by `from` in the middle of the first cell, and so
/// much more for each cell to the right and down.
struct Side {
  Vector3d across = Vector3d::Zero();  // unit normal of the plane of eye and side, inwards
  double from = 0, right = 0, down = 0;
  double columns = 0;  // 1 / right

  /// What of a row is inside, or outside by less than `beyond`.
  void cut(int row, double beyond, Span& span) const {
    constexpr double most = 1e6;
    const double inside = from + row * down + beyond;
    const double column = std::clamp(-inside * columns, -most, most);
    if (right > 0) {
      span.first = std::max(span.first, static_cast<int>(std::ceil(column)));
    } else if (right < 0) {
      span.last = std::min(span.last, static_cast<int>(std::floor(column)) + 1);
    } else if (inside < 0) {
      span.last = span.first;
    }
  }
};

struct Face {
  std::array<Side, 3> sides;
  std::array<Vector3d, 3> corners;    // along the image's axes
  Vector3d depth = Vector3d::Zero();  // inverse, of its plane, at [x y 1]; 0: seen edge-on
  double nearest = 0;                 // inverse depth of its nearest corner
  double margin = 0;                  // rad; beams so far beside it may meet it
  Eigen::Vector2d low, high;          // image
  bool seen = false;                  // not too flat to be named

  /// Whether all of it lies behind the plane of this one, or in it.
  bool hides(const Face& other) const {
    constexpr double least = 1 - 1e-7;
    return depth.dot(other.corners[0]) >= least && depth.dot(other.corners[1]) >= least &&
           depth.dot(other.corners[2]) >= least;
  }
};

double length1(const Vector3d& image) { return std::abs(image.x()) + std::abs(image.y()); }

}  // namespace

/// Depths are inverse: linear in the image.
class FaceImage::Painter {
 public:
  Painter(FaceImage& image, const TargetModel& model) : image_(image), model_(model) {}

  void paint(int cells) {
    image_.triangles_.assign(1, unknown);
    if (!frame(cells)) return;
    const auto& triangles = model_.target.mesh.triangles;
    faces_.reserve(triangles.size());
    for (const auto& corners : triangles) faces_.push_back(face(corners));
    const std::size_t count = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
    image_.triangles_.assign(count + 1, unknown);
    nearest_.assign(count, 0);
    for (std::size_t t = 0; t < faces_.size(); ++t) fill(static_cast<std::int32_t>(t));
    for (std::size_t t = 0; t < faces_.size(); ++t) doubt(static_cast<std::int32_t>(t));
  }

 private:
  /// @return false where it cannot be drawn.
  bool frame(int cells) {
    const View& view = image_.view_;
    const Vector3d ahead = model_.centre - view.eye;
    least_range_ = ahead.norm() - model_.radius;
    if (!(least_range_ > 2 * (slack_m + view.sway))) return false;
    Matrix3d axes;
    axes.row(2) = ahead.normalized();
    axes.row(0) = ahead.unitOrthogonal();
    axes.row(1) = axes.row(2).cross(axes.row(0));
    Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
    Eigen::Vector2d high = -low;
    corners_.reserve(model_.target.mesh.vertices.size());
    for (const Vector3d& vertex : model_.target.mesh.vertices) {
      const Vector3d& corner = corners_.emplace_back(axes * (vertex - view.eye));
      low = low.cwiseMin(corner.head<2>() / corner.z());
      high = high.cwiseMax(corner.head<2>() / corner.z());
      most_range_ = std::max(most_range_, corner.norm());
    }
    const Eigen::Vector2d wide = (-low).cwiseMax(high);
    if (!(wide.maxCoeff() < widest)) return false;
    widening_ = std::sqrt(1 + wide.squaredNorm());
    cell_ = (high - low).maxCoeff() / cells;
    const Eigen::Vector2i size = ((high - low) / cell_).cast<int>().array() + 1;
    low_ = low;
    columns_ = size.x();
    rows_ = size.y();
    // Where a beam from beside the eye meets a face is seen elsewhere than where it returned from.
    const double nearest = least_range_ - slack_m - view.sway;
    shift_ = view.sway * slack_m / (nearest * nearest) + rounding;

    image_.eye_ = four(view.eye);
    image_.right_ = four(axes.row(0));
    image_.down_ = four(axes.row(1));
    image_.ahead_ = four(axes.row(2));
    image_.per_cell_ = four(1 / cell_);
    image_.left_ = four(low.x() / cell_);
    image_.top_ = four(low.y() / cell_);
    image_.columns_ = four(columns_);
    image_.rows_ = four(rows_);
    image_.outside_ = four(columns_ * rows_);
    return true;
  }

  Face face(const std::array<std::uint32_t, 3>& indices) const {
    const View& view = image_.view_;
    Face face;
    double farthest = 0;
    double least_depth = std::numeric_limits<double>::infinity();
    face.low.setConstant(std::numeric_limits<double>::infinity());
    face.high = -face.low;
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d& c = face.corners[i] = corners_[indices[i]];
      farthest = std::max(farthest, c.norm());
      least_depth = std::min(least_depth, c.z());
      face.low = face.low.cwiseMin(c.head<2>() / c.z());
      face.high = face.high.cwiseMax(c.head<2>() / c.z());
    }
    face.nearest = 1 / least_depth;
    // From beside the eye, what stands before others is seen before something else.
    const double before = most_range_ - least_depth + 2 * view.sway;
    const double parallax = view.sway * before / (least_depth * least_range_);
    face.margin = std::sqrt(2.0) * view.reach + shift_ + parallax;

    const auto& [a, b, c] = face.corners;
    const Vector3d normal = (b - a).cross(c - a).normalized();
    const double height = std::abs(normal.dot(a)) - view.sway;  // of eyes over its plane, least
    if (height > 0) face.depth = normal / normal.dot(a);
    face.seen = height > min_facing_cosine * (farthest + view.sway);
    for (std::size_t i = 0; i < 3; ++i) {
      Side& side = face.sides[i];
      side.across = face.corners[i].cross(face.corners[(i + 1) % 3]).normalized();
      if (side.across.dot(face.corners[(i + 2) % 3]) < 0) side.across = -side.across;
      side.from = side.across.dot(middle_of(0));
      side.right = side.across.x() * cell_;
      side.down = side.across.y() * cell_;
      constexpr double level = 1e-12;
      if (std::abs(side.right) < level) side.right = 0;
      side.columns = side.right == 0 ? 0 : 1 / side.right;
    }
    return face;
  }

  /// Of a cell, in the image.
  Vector3d middle_of(int row, int column = 0) const {
    return {low_.x() + (column + 0.5) * cell_, low_.y() + (row + 0.5) * cell_, 1};
  }

  /// Rows of cells whose middles come as near as this to a face, rad and cells.
  template <class Paint>
  void for_rows(const Face& face, double margin, double cells, const Paint& paint) {
    const double beside = image_angle(margin);
    const auto index = [this](double image, double low, int most) {
      return static_cast<int>(std::clamp((image - low) / cell_, 0.0, static_cast<double>(most)));
    };
    const Span columns{index(face.low.x() - beside, low_.x(), columns_),
                       index(face.high.x() + beside + cell_, low_.x(), columns_)};
    const int last = index(face.high.y() + beside + cell_, low_.y(), rows_);
    std::array<double, 3> beyond;
    for (std::size_t i = 0; i < 3; ++i) {
      beyond[i] = margin * widening_ + cells * 0.5 * cell_ * length1(face.sides[i].across);
    }
    for (int row = index(face.low.y() - beside, low_.y(), rows_); row < last; ++row) {
      Span span = columns;
      for (std::size_t i = 0; i < 3; ++i) face.sides[i].cut(row, beyond[i], span);
      if (span.first < span.last) paint(row, span);
    }
  }

  /// A small angle, where it is the most.
  double image_angle(double angle) const { return 1.02 * widening_ * widening_ * angle; }

  std::size_t index(int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_);
  }

  /// Cells in whose middle it is the foremost.
  void fill(std::int32_t t) {
    const Face& face = faces_[static_cast<std::size_t>(t)];
    if (!face.seen) return;
    for_rows(face, 0, 0, [&](int row, Span span) {
      const auto base = static_cast<float>(face.depth.dot(middle_of(row)));
      const auto slope = static_cast<float>(face.depth.x() * cell_);
      float* const depth = &nearest_[index(row)];
      std::int32_t* const triangle = &image_.triangles_[index(row)];
      for (int c = span.first; c < span.last; ++c) {
        const float here = base + slope * static_cast<float>(c);
        const bool nearer = here > depth[c];
        depth[c] = nearer ? here : depth[c];
        triangle[c] = nearer ? t : triangle[c];
      }
    });
  }

  /// Cells in which it may come before the one named.
  void doubt(std::int32_t t) {
    const Face& face = faces_[static_cast<std::size_t>(t)];
    for_rows(face, face.margin, 1, [&](int row, Span span) {
      std::int32_t* const triangle = &image_.triangles_[index(row)];
      std::int32_t hiding = t;  // the last that hides all of it
      for (int c = span.first; c < span.last; ++c) {
        if (triangle[c] == unknown || triangle[c] == t || triangle[c] == hiding) continue;
        const Face& named = faces_[static_cast<std::size_t>(triangle[c])];
        if (named.hides(face)) {
          hiding = triangle[c];
        } else if (!behind(face, named, middle_of(row, c))) {
          triangle[c] = unknown;
        }
      }
    });
  }

  /// Whether, all over a cell and its margin, it lies behind the other's plane.
  bool behind(const Face& face, const Face& other, const Vector3d& middle) const {
    const double reach = 0.5 * cell_ + image_angle(face.margin);
    const double there = other.depth.dot(middle) * (1 - rounding);
    if (face.nearest < there - reach * length1(other.depth)) return true;
    if (face.depth.isZero(0)) return false;
    const Vector3d nearer = face.depth - other.depth;
    return nearer.dot(middle) + reach * length1(nearer) < -rounding * there;
  }

  FaceImage& image_;
  const TargetModel& model_;
  std::vector<Vector3d> corners_;  // of the mesh, along the image's axes
  std::vector<Face> faces_;
  std::vector<float> nearest_;  // inverse depth in the middle of cells
  Eigen::Vector2d low_;         // of the image
  double cell_ = 0;             // side
  int columns_ = 0, rows_ = 0;
  double least_range_ = 0, most_range_ = 0;
  double widening_ = 1;  // length of [x y 1], most
  double shift_ = 0;     // rad
};

FaceImage::FaceImage(const TargetModel& model, const View& view, int cells) : view_(view) {
  Painter(*this, model).paint(cells);
}

}  // namespace berth::estimator
