// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/template_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

namespace berth::estimator {
namespace {

constexpr double cell_of_length = 0.025;
constexpr int reach = 4;  // cells
constexpr double max_cells = 3e7;
/// Mean field value that the first points of a template need; also the value of occluded cells.
constexpr int min_early = 0.6 * 255;
constexpr int template_turns = 30;  // about the line of sight, of each template
constexpr double bin = 0.2;         // rad, of lines of sight that share rotated templates
/// Pool size per requested placement, before non-maximum suppression.
constexpr std::size_t pooled = 40;

/// Truncated distance field of the returns: 255 at a return, the minimum from `reach` cells on.
/// Padded, so that indices may leave the box.
class ReturnField {
 public:
  /// @param around m, by which the box is larger than the points on all sides
  /// @param margin m, by which queries may be beyond a point
  /// @param min_score minimum value, 0 to 255
  ReturnField(const std::vector<Vector3d>& points, double cell, double around, double margin,
              std::uint8_t min_score)
      : cell_(cell) {
    Vector3d low = Vector3d::Constant(1e9), high = Vector3d::Constant(-1e9);
    for (const Vector3d& p : points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    low.array() -= around;
    high.array() += around;
    const Vector3d size = high - low + Vector3d::Constant(2 * (reach + 1) * cell_);
    cell_ = std::max(cell_, std::cbrt(size.prod() / max_cells));
    low_ = low - Vector3d::Constant((reach + 1) * cell_);
    for (int i = 0; i < 3; ++i) {
      size_[static_cast<std::size_t>(i)] =
          static_cast<int>((high[i] - low[i]) / cell_) + 2 * (reach + 1) + 1;
    }
    const auto out = static_cast<int>(std::ceil(margin / cell_)) + 1;
    empty_ = out * (1 + size_[0] + size_[0] * size_[1]);
    values_.assign(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) *
                           static_cast<std::size_t>(size_[2]) +
                       2 * static_cast<std::size_t>(empty_),
                   min_score);
    struct Stamp {
      int offset;
      std::uint8_t value;
    };
    std::vector<Stamp> ball;
    for (int z = -reach; z <= reach; ++z) {
      for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
          const double away = std::sqrt(x * x + y * y + z * z) / reach;
          if (away < 1) {
            ball.push_back({offset({x, y, z}), static_cast<std::uint8_t>(255 * (1 - away))});
          }
        }
      }
    }
    for (const Vector3d& p : points) {
      const int at = index(p);
      for (const Stamp& s : ball) {
        std::uint8_t& v = values_[static_cast<std::size_t>(at + s.offset)];
        v = std::max(v, s.value);
      }
    }
  }

  /// Sets cells that are occluded, unless a return is near.
  template <typename Unknown>
  void mark(const Unknown& occluded) {
    for (int z = 0; z < size_[2]; ++z) {
      for (int y = 0; y < size_[1]; ++y) {
        for (int x = 0; x < size_[0]; ++x) {
          std::uint8_t& v = values_[static_cast<std::size_t>(empty_ + offset({x, y, z}))];
          if (v <= min_early && occluded(low_ + cell_ * Vector3d(x + 0.5, y + 0.5, z + 0.5)))
            v = min_early;
        }
      }
    }
  }

  int index(const Vector3d& p) const {
    const Vector3d c = (p - low_) / cell_;
    return empty_ +
           offset({static_cast<int>(c.x()), static_cast<int>(c.y()), static_cast<int>(c.z())});
  }
  /// Index differences of displacements (m).
  template <typename Places, typename Offsets>
  void offsets_of(const Places& d, Offsets&& offsets) const {
    const auto cells = static_cast<float>(1 / cell_);
    const auto along = [&](int axis) { return (d.col(axis) * cells).round().template cast<int>(); };
    offsets = along(0) + size_[0] * (along(1) + size_[1] * along(2));
  }
  const std::uint8_t* values() const { return values_.data(); }

 private:
  int offset(const std::array<int, 3>& c) const {
    return c[0] + size_[0] * (c[1] + size_[1] * c[2]);
  }
  double cell_;
  Vector3d low_;
  std::array<int, 3> size_{};
  int empty_ = 0;
  std::vector<std::uint8_t> values_;
};

bool better(const Placement& a, const Placement& b) {
  if (a.score != b.score) return a.score > b.score;
  for (int i = 0; i < 3; ++i) {
    if (a.pose.position[i] != b.pose.position[i]) return a.pose.position[i] < b.pose.position[i];
  }
  return a.pose.rotation.x() < b.pose.rotation.x();
}

/// Best first; of placements near each other the best.
std::vector<Placement> non_maximum_suppression(std::vector<Placement> all, const Vector3d& centre,
                                               double away, std::size_t count) {
  std::sort(all.begin(), all.end(), better);
  std::vector<Placement> kept;
  std::vector<Vector3d> middles;
  for (const Placement& p : all) {
    if (kept.size() == count) break;
    const Vector3d middle = p.pose * centre;
    bool near = false;
    for (std::size_t k = 0; k < kept.size() && !near; ++k) {
      near = (middles[k] - middle).squaredNorm() < away * away &&
             std::abs(kept[k].pose.rotation.dot(p.pose.rotation)) > 0.9945;  // 12 degrees
    }
    if (near) continue;
    kept.push_back(p);
    middles.push_back(middle);
  }
  return kept;
}

}  // namespace

std::vector<Placement> match_templates(const RangeImage& image, const std::vector<Vector3d>& points,
                                       const std::vector<Vector3d>& anchors,
                                       const std::vector<char>& occluding,
                                       const std::vector<ViewTemplate>& templates,
                                       const Vector3d& centre, double radius, double length,
                                       double max_cost, std::size_t placements) {
  if (points.empty()) return {};
  // All in the image's axes.
  const Matrix3d to_image = image.axes();
  std::vector<Vector3d> places;
  double range = 0;
  for (const Vector3d& p : points) {
    places.emplace_back(to_image * p);
    range += p.norm() / static_cast<double>(points.size());
  }
  // By the target's size, at least such that points between returns are near one.
  const double cell =
      std::max(cell_of_length * length, 1.5 / reach * image.widest_spacing() * range);
  const bool hidden = std::find(occluding.begin(), occluding.end(), 1) != occluding.end();
  ReturnField field(places, cell, hidden ? 2 * radius : 0, 2.2 * radius,
                    static_cast<std::uint8_t>(255 * std::max(0.0, 0.5 - max_cost)));
  if (hidden) {
    field.mark([&](const Vector3d& p) {
      const auto q = p.cast<float>();
      const int at = image.pixel(q.x(), q.y(), q.z());
      const int beam = at < 0 ? -1 : image.beam_at(at);
      if (beam < 0) return false;
      const auto b = static_cast<std::size_t>(beam);
      return occluding[b] != 0 && image.beams()[b].range < p.norm();
    });
  }
  const std::uint8_t* values = field.values();

  std::map<std::array<int, 2>, std::vector<Vector3d>> bins;
  for (const Vector3d& anchor : anchors) {
    const Vector3d p = to_image * anchor;
    bins[{static_cast<int>(std::round(std::atan2(p.x(), p.z()) / bin)),
          static_cast<int>(std::round(std::asin(p.y() / p.norm()) / bin))}]
        .push_back(p);
  }
  std::vector<Placement> pool;
  double floor = -std::numeric_limits<double>::infinity();  // minimum score
  const auto add = [&](const Pose& pose, double score) {
    pool.push_back({pose, score});
    if (pool.size() < pooled * placements) return;
    std::nth_element(pool.begin(),
                     pool.begin() + static_cast<std::ptrdiff_t>(pooled / 4 * placements),
                     pool.end(), better);
    pool.resize(pooled / 4 * placements);
    floor = pool.back().score;
    for (const Placement& p : pool) floor = std::min(floor, p.score);
  };
  const auto seen_through = static_cast<float>(0.05 * length);
  const auto at_depth = static_cast<float>(0.08 * length);
  constexpr int count = ViewTemplate::surface_points;
  constexpr int first = 16;
  Eigen::Array<int, count, 1> offsets;
  Eigen::Array<float, count, 3> on;
  decltype(ViewTemplate::outside) outline;
  const auto rotated = [](const Eigen::Matrix3f& r, const auto& from, auto&& to) {
    for (int k = 0; k < 3; ++k) {
      to.col(k) = r(k, 0) * from.col(0) + r(k, 1) * from.col(1) + r(k, 2) * from.col(2);
    }
  };
  for (const auto& [key, here] : bins) {
    Vector3d line_of_sight = Vector3d::Zero();
    std::vector<const std::uint8_t*> places_of;  // in the field
    for (const Vector3d& p : here) {
      line_of_sight += p.normalized();
      places_of.push_back(values + field.index(p));
    }
    const Quaterniond aim = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), line_of_sight);
    std::array<Quaterniond, template_turns> turns;
    for (int turn = 0; turn < template_turns; ++turn) {
      turns[static_cast<std::size_t>(turn)] =
          aim *
          Quaterniond(Eigen::AngleAxisd(radians(360) * turn / template_turns, Vector3d::UnitZ()));
    }
    for (const ViewTemplate& t : templates) {
      for (const Quaterniond& rotation : turns) {
        const Eigen::Matrix3f r = rotation.toRotationMatrix().cast<float>();
        // The other points are rotated once the first fit at an anchor.
        rotated(r, t.points.topRows<first>(), on.topRows<first>());
        field.offsets_of(on.topRows<first>(), offsets.head<first>());
        bool all_rotated = false;
        for (int a = 0; a < ViewTemplate::anchors; ++a) {
          for (std::size_t h = 0; h < here.size(); ++h) {
            const std::uint8_t* near = places_of[h] - offsets[a];
            int sum = 0;
            int i = 0;
            for (; i < 5; ++i) sum += near[offsets[i]];
            if (sum < 5 * min_early) continue;
            for (; i < 10; ++i) sum += near[offsets[i]];
            if (sum < 10 * min_early) continue;
            for (; i < first; ++i) sum += near[offsets[i]];
            if (sum < first * min_early) continue;
            if (!std::exchange(all_rotated, true)) {
              rotated(r, t.points.bottomRows<count - first>(), on.bottomRows<count - first>());
              field.offsets_of(on.bottomRows<count - first>(), offsets.tail<count - first>());
              outline.resize(t.outside.rows(), 3);
              rotated(r, t.outside, outline);
            }
            for (; i < count; ++i) sum += near[offsets[i]];
            const Eigen::Vector3f middle = here[h].cast<float>() - on.row(a).matrix().transpose();
            const double pixel = image.spacing() * static_cast<double>(middle.norm());
            const double beams = t.area / (pixel * pixel);
            int visible = count;
            for (i = 0; i < count && hidden; ++i) {
              if (near[offsets[i]] != min_early) continue;
              sum -= min_early;
              --visible;
            }
            double score = beams / count * (sum / 255.0 - 0.5 * visible);
            for (i = 0; i < count && score > floor; ++i) {
              const Eigen::Vector3f p = middle + on.row(i).matrix().transpose();
              const int at = image.pixel(p.x(), p.y(), p.z());
              if (at >= 0 && image.farthest_about(at) > 0 &&
                  image.nearest_about(at) > p.norm() + seen_through) {
                score -= beams / count * std::min(1.0, near[offsets[i]] / 255.0 - 0.5 + max_cost);
              }
            }
            const auto around = outline.rows();
            for (i = 0; i < around && score > floor; ++i) {
              const Eigen::Vector3f p = middle + outline.row(i).matrix().transpose();
              const int at = image.pixel(p.x(), p.y(), p.z());
              const int beam = at < 0 ? -1 : image.beam_at(at);
              if (beam < 0) continue;
              const auto z =
                  static_cast<float>(image.beams()[static_cast<std::size_t>(beam)].range);
              if (std::abs(z - p.norm()) < at_depth) {
                score -= t.perimeter / pixel / static_cast<double>(around);
              }
            }
            if (score <= floor) continue;
            Pose pose;
            pose.rotation = (Quaterniond(to_image.transpose()) * rotation * t.view).normalized();
            pose.position = to_image.transpose() * middle.cast<double>() - pose.rotation * centre;
            add(pose, score);
          }
        }
      }
    }
  }
  return non_maximum_suppression(std::move(pool), centre, 0.04 * length, placements);
}

}  // namespace berth::estimator
