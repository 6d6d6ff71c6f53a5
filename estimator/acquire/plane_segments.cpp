// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/plane_segments.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

namespace berth::estimator {
namespace {

constexpr double off_sigmas = 3;  // of a return, from its plane
constexpr int seed_reach = 2;     // pixels to each side of where a plane begins
constexpr std::size_t min_seed = 8;

/// Of places, and the plane of least squares through them.
class Moments {
 public:
  void add(const Vector3d& p) {
    sum_ += p;
    squares_ += p * p.transpose();
    count_ += 1;
  }
  struct Plane {
    Vector3d normal;
    double offset;  // normal . p
  };
  Plane plane() const {
    const Vector3d mean = sum_ / count_;
    const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(squares_ / count_ - mean * mean.transpose());
    const Vector3d normal = axes.eigenvectors().col(0);
    return {normal, normal.dot(mean)};
  }

 private:
  Vector3d sum_ = Vector3d::Zero();
  Matrix3d squares_ = Matrix3d::Zero();
  double count_ = 0;
};

}  // namespace

PlaneSegments plane_segments(const RangeImage& image, const std::vector<char>& among) {
  const auto& beams = image.beams();
  PlaneSegments result;
  result.of_beam.assign(beams.size(), -1);
  const double sigma = image.noise().range_sigma_m;
  const double depth = std::max(1.0, image.farthest() - image.nearest());
  const auto beam = [&](int b) -> const Beam& { return beams[static_cast<std::size_t>(b)]; };
  const auto free = [&](int b) {
    const auto at = static_cast<std::size_t>(b);
    return among[at] != 0 && beam(b).hit() && result.of_beam[at] < 0;
  };
  // Beams about one within so many pixels that are of no plane yet.
  const auto about = [&](int b, int reach, auto&& use) {
    const int x = image.pixel_of(b) % image.width();
    const int y = image.pixel_of(b) / image.width();
    for (int v = std::max(0, y - reach); v <= std::min(image.height() - 1, y + reach); ++v) {
      for (int u = std::max(0, x - reach); u <= std::min(image.width() - 1, x + reach); ++u) {
        const int other = image.beam_at(u + image.width() * v);
        if (other >= 0 && free(other)) use(other);
      }
    }
  };
  const auto on = [&](int b, const Moments::Plane& plane) {
    const double slope = plane.normal.dot(beam(b).direction);
    if (std::abs(slope) < 0.1) return false;
    const double cosine = std::abs(slope);
    const double width =
        std::sqrt(sigma * sigma + image.noise().angle_variance() * std::pow(beam(b).range, 2) *
                                      (1 / (cosine * cosine) - 1));
    return std::abs(beam(b).range - plane.offset / slope) < off_sigmas * width;
  };
  std::vector<int> taken(beams.size(), -1);  // by which pass
  int pass = 0;
  for (int start = 0; start < static_cast<int>(beams.size()); ++start) {
    if (!free(start)) continue;
    Moments moments;
    std::vector<int> seed;
    about(start, seed_reach, [&](int b) { seed.push_back(b); });
    if (seed.size() < min_seed) continue;
    for (const int b : seed) moments.add(beam(b).point());
    Moments::Plane plane = moments.plane();
    std::size_t fits = 0;
    for (const int b : seed) fits += on(b, plane) ? 1 : 0;
    if (fits < seed.size()) continue;
    // A plane through few beams is turned by their noise: by those that it then holds, again.
    std::vector<int> members;
    for (std::size_t before = 0;; before = members.size()) {
      ++pass;
      members = {start};
      taken[static_cast<std::size_t>(start)] = pass;
      Moments grown;
      grown.add(beam(start).point());
      for (std::size_t i = 0; i < members.size(); ++i) {
        about(members[i], 1, [&](int b) {
          int& by = taken[static_cast<std::size_t>(b)];
          if (by == pass || !on(b, plane)) return;
          by = pass;
          members.push_back(b);
          grown.add(beam(b).point());
        });
      }
      if (members.size() < min_seed || 10 * members.size() < 11 * before) break;
      plane = grown.plane();
    }
    if (members.size() < 3 * min_seed) continue;
    for (const int b : members) {
      result.of_beam[static_cast<std::size_t>(b)] = static_cast<int>(result.nats.size());
    }
    const double known = sigma * std::sqrt(3 / static_cast<double>(members.size()));
    result.nats.push_back(
        std::max(0.0, 3 * std::log(depth / known) - 1.5 * std::log(2 * std::numbers::pi)));
  }
  return result;
}

}  // namespace berth::estimator
