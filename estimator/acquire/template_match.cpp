// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/template_match.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>

namespace berth::estimator {
namespace {

constexpr double cell_of_length = 0.025;
constexpr int reach = 4;  // cells
constexpr double max_cells = 3e7;
/// Of the field at its highest, what the first points of a template have where it fits.
constexpr int early = 0.6 * 255;
constexpr double bin = 0.2;  // rad, of lines of sight for which templates are turned once
constexpr std::size_t max_pool = 24000;

/// How near a place is to a return: 255 there, 0 from `reach` cells on. A margin all around is
/// empty, so that an index may leave the box.
class ReturnField {
 public:
  ReturnField(const std::vector<Vector3d>& points, double cell, double margin) : cell_(cell) {
    Vector3d low = Vector3d::Constant(1e9), high = Vector3d::Constant(-1e9);
    for (const Vector3d& p : points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
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
                   0);
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

  int index(const Vector3d& p) const {
    const Vector3d c = (p - low_) / cell_;
    return empty_ +
           offset({static_cast<int>(c.x()), static_cast<int>(c.y()), static_cast<int>(c.z())});
  }
  /// Between the indices of two places so far apart (m).
  int offset_of(const Vector3d& d) const {
    return offset({static_cast<int>(std::lround(d.x() / cell_)),
                   static_cast<int>(std::lround(d.y() / cell_)),
                   static_cast<int>(std::lround(d.z() / cell_))});
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

/// The first of every cube with that side, then so many at even steps.
std::vector<Vector3d> thinned(const std::vector<Vector3d>& points, double side, int max) {
  std::map<std::array<int, 3>, bool> taken;
  std::vector<Vector3d> kept;
  for (const Vector3d& p : points) {
    const std::array<int, 3> cube = {static_cast<int>(std::floor(p.x() / side)),
                                     static_cast<int>(std::floor(p.y() / side)),
                                     static_cast<int>(std::floor(p.z() / side))};
    if (taken.emplace(cube, true).second) kept.push_back(p);
  }
  const auto count = static_cast<std::size_t>(max);
  if (kept.size() <= count) return kept;
  std::vector<Vector3d> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(kept[i * kept.size() / count]);
  return some;
}

bool better(const Placement& a, const Placement& b) {
  if (a.score != b.score) return a.score > b.score;
  for (int i = 0; i < 3; ++i) {
    if (a.pose.position[i] != b.pose.position[i]) return a.pose.position[i] < b.pose.position[i];
  }
  return a.pose.rotation.x() < b.pose.rotation.x();
}

/// Best first, of those near each other the best.
std::vector<Placement> suppressed(std::vector<Placement> all, const Vector3d& centre, double away,
                                  std::size_t count) {
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
                                       const std::vector<ViewTemplate>& templates,
                                       const Vector3d& centre, double radius, double length,
                                       const TemplateMatchOptions& options) {
  if (points.empty()) return {};
  const ReturnField field(points, cell_of_length * length, 2.2 * radius);
  const std::uint8_t* values = field.values();

  std::map<std::array<int, 2>, std::vector<Vector3d>> bins;
  for (const Vector3d& p : thinned(points, 0.05 * length, options.max_anchors)) {
    bins[{static_cast<int>(std::floor(std::atan2(p.x(), p.z()) / bin)),
          static_cast<int>(std::floor(std::asin(p.y() / p.norm()) / bin))}]
        .push_back(p);
  }
  std::vector<Placement> pool;
  double floor = 0;  // of scores worth keeping
  const auto add = [&](const Pose& pose, double score) {
    pool.push_back({pose, score});
    if (pool.size() < max_pool) return;
    std::nth_element(pool.begin(), pool.begin() + max_pool / 4, pool.end(), better);
    pool.resize(max_pool / 4);
    floor = pool.back().score;
    for (const Placement& p : pool) floor = std::min(floor, p.score);
  };
  constexpr std::size_t most = 64;
  std::array<int, most> offsets{};
  std::array<Vector3d, most> places, outside;
  for (const auto& [key, anchors] : bins) {
    Vector3d sight = Vector3d::Zero();
    for (const Vector3d& p : anchors) sight += p.normalized();
    const Quaterniond aim = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), sight);
    for (const ViewTemplate& t : templates) {
      const std::size_t count = std::min(most, t.points.size());
      const std::size_t around = std::min(most, t.outside.size());
      for (int turn = 0; turn < options.turns; ++turn) {
        const Quaterniond rotation =
            aim *
            Quaterniond(Eigen::AngleAxisd(radians(360) * turn / options.turns, Vector3d::UnitZ()));
        const Matrix3d r = rotation.toRotationMatrix();
        for (std::size_t i = 0; i < count; ++i) {
          places[i] = r * t.points[i];
          offsets[i] = field.offset_of(places[i]);
        }
        for (std::size_t i = 0; i < around; ++i) outside[i] = r * t.outside[i];
        for (std::size_t a = 0; a < ViewTemplate::anchors; ++a) {
          for (const Vector3d& anchor : anchors) {
            const int base = field.index(anchor) - offsets[a];
            int sum = 0;
            std::size_t i = 0;
            for (; i < 5; ++i) sum += values[base + offsets[i]];
            if (sum < 5 * early) continue;
            for (; i < 10; ++i) sum += values[base + offsets[i]];
            if (sum < 10 * early) continue;
            for (; i < count; ++i) sum += values[base + offsets[i]];
            const Vector3d middle = anchor - places[a];
            const double pixel = image.spacing() * middle.norm();
            const double beams = t.area / (pixel * pixel);
            const double mean = sum / (255.0 * static_cast<double>(count)) - 0.5;
            if (beams * mean <= floor) continue;
            int through = 0;
            for (i = 0; i < count; ++i) {
              const Vector3d p = middle + places[i];
              const int at = image.pixel(p);
              if (at >= 0 && image.farthest_about(at) > 0 &&
                  static_cast<double>(image.nearest_about(at)) > p.norm() + 0.05 * length) {
                ++through;
              }
            }
            double score = beams * (mean - through / static_cast<double>(count));
            if (score <= floor) continue;
            int stopped = 0;
            for (i = 0; i < around; ++i) {
              const Vector3d p = middle + outside[i];
              const int at = image.pixel(p);
              if (at < 0) continue;
              const int beam = image.beam_at(at);
              if (beam < 0) continue;
              const double range = image.beams()[static_cast<std::size_t>(beam)].range;
              if (std::abs(range - p.norm()) < 0.08 * length) ++stopped;
            }
            score -= t.perimeter / pixel * stopped / std::max<double>(1, around);
            if (score <= floor) continue;
            Pose pose;
            pose.rotation = (rotation * t.view).normalized();
            pose.position = middle - pose.rotation * centre;
            add(pose, score);
          }
        }
      }
    }
  }
  return suppressed(std::move(pool), centre, 0.04 * length,
                    static_cast<std::size_t>(options.placements));
}

}  // namespace berth::estimator
