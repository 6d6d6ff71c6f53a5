// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_beam.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace berth::estimator {

namespace {

/// The nodes whose light makes the first echo.
struct FirstEcho {
  double front = std::numeric_limits<double>::infinity();  // m
  std::size_t nearest = 0;
  double end = 0;     // m: what is nearer belongs to it
  double share = 0;   // of the beam
  double mean = 0;    // m
  double spread = 0;  // m^2

  explicit FirstEcho(const EdgeBeam& beam) {
    for (std::size_t n = 0; n < BeamNodes::count; ++n) {
      if (!(beam.hits[n].range < front)) continue;
      front = beam.hits[n].range;
      nearest = n;
    }
    end = front + beam.pulse_m;
    double first = 0;
    double second = 0;
    for (std::size_t n = 0; n < BeamNodes::count; ++n) {
      if (!holds(beam.hits[n])) continue;
      const double depth = beam.hits[n].range - front;
      share += BeamNodes::weight[n];
      first += BeamNodes::weight[n] * depth;
      second += BeamNodes::weight[n] * depth * depth;
    }
    if (!(share > 0)) return;
    first /= share;
    mean = front + first;
    spread = std::max(0.0, second / share - first * first);
  }

  bool holds(const RayHit& hit) const {
    return std::isfinite(hit.range) && (hit.range <= front || hit.range < end);
  }
};

}  // namespace

bool EdgeBeam::one_plane(double tolerance) const {
  if (!std::isfinite(hits[0].range)) return false;
  const Vector3d& normal = hits[0].normal;
  const Vector3d place = rays[0].origin + hits[0].range * rays[0].direction;
  for (std::size_t n = 1; n < hits.size(); ++n) {
    if (!std::isfinite(hits[n].range) || normal.dot(hits[n].normal) < 0.99) return false;
    const Vector3d other = rays[n].origin + hits[n].range * rays[n].direction;
    if (std::abs(normal.dot(other - place)) > tolerance) return false;
  }
  return true;
}

bool EdgeBeam::meets() const {
  return std::any_of(hits.begin(), hits.end(),
                     [](const RayHit& hit) { return std::isfinite(hit.range); });
}

std::optional<MixedEcho> mixed_echo(const EdgeBeam& beam, double least_cosine) {
  const FirstEcho first(beam);
  if (!(first.share > 0)) return std::nullopt;
  MixedEcho echo;
  echo.range = first.mean;
  echo.spread = first.spread;
  echo.share = first.share;
  for (std::size_t n = 0; n < BeamNodes::count; ++n) {
    const RayHit& hit = beam.hits[n];
    if (!first.holds(hit)) continue;
    const Ray& ray = beam.rays[n];
    const double cosine = -hit.normal.dot(ray.direction);
    const Vector3d row = BeamNodes::weight[n] / first.share *
                         (cosine > least_cosine ? Vector3d(hit.normal / cosine) : -ray.direction);
    echo.normal += row;
    echo.torque += (ray.origin + hit.range * ray.direction).cross(row);
  }
  return echo;
}

EdgeScore edge_score(const EdgeBeam& edge, const Beam& beam, double variance,
                     const LikelihoodOptions& shares, double least_cosine) {
  const FirstEcho first(edge);
  const double wide = edge.footprint;
  const double rare = shares.outlier / shares.background_depth_m;
  const double regularly = 1 - shares.drop_out - shares.outlier;
  const auto peak = [&](double its_variance) {
    return regularly / std::sqrt(2 * radians(180.0) * its_variance);
  };
  // A narrow beam meets one surface by chance, a wide one several at once.
  const double mixed_variance = variance + first.spread;
  const double mixed_late = beam.hit() ? beam.range - first.mean : 0;
  const double mixed =
      beam.hit() ? peak(mixed_variance) * std::exp(-0.5 * mixed_late * mixed_late / mixed_variance)
                 : 0;
  const double mixed_pull = mixed * mixed_late / mixed_variance;

  const double highest = peak(variance);
  std::array<double, BeamNodes::count> regular{};
  std::array<double, BeamNodes::count> density{};
  double in_first = 0;
  double in_others = 0;
  for (std::size_t n = 0; n < BeamNodes::count; ++n) {
    const bool meets = std::isfinite(edge.hits[n].range);
    const bool in = first.holds(edge.hits[n]);
    if (!beam.hit()) {
      density[n] = meets ? shares.drop_out : 1 - shares.background;
    } else if (!meets) {
      density[n] = shares.background / shares.background_depth_m;
    } else {
      const double late = beam.range - edge.hits[n].range;
      regular[n] = highest * std::exp(-0.5 * late * late / variance);
      density[n] = rare + (in ? (1 - wide) * regular[n] + wide * mixed : regular[n]);
    }
    (in ? in_first : in_others) += BeamNodes::weight[n] * density[n];
  }
  // The first echo is seen as soon as it has some light: by so much more than its share of it, and
  // what is behind by so much less. Derivatives with the share.
  double more = 1 / first.share;
  double more_slope = -more * more;
  double less = 0;
  double less_slope = 0;
  if (first.share < edge.least_light) {
    const double rest = 1 - first.share;
    more = 1 / edge.least_light;
    more_slope = 0;
    less = (1 - more * first.share) / rest;
    less_slope = (1 - more) / (rest * rest);
  }
  more = 1 + wide * (more - 1);
  less = 1 + wide * (less - 1);
  const double by_share = wide * (more_slope * in_first + less_slope * in_others);

  EdgeScore score;
  score.front = first.front;
  const double sum = more * in_first + less * in_others;
  const Vector3d per_right = edge.right / std::max(1e-30, edge.right.squaredNorm());
  const Vector3d per_up = edge.up / std::max(1e-30, edge.up.squaredNorm());
  // The edge is the front face's: it goes where that goes.
  const Ray& to_front = edge.rays[first.nearest];
  const Vector3d place = to_front.origin + first.front * to_front.direction;
  Vector3d inwards = Vector3d::Zero();
  Vector3d sideways = Vector3d::Zero();
  for (std::size_t n = 0; n < BeamNodes::count; ++n) {
    const RayHit& hit = edge.hits[n];
    const Vector3d& direction = edge.rays[n].direction;
    const bool in = first.holds(hit);
    const double weight = BeamNodes::weight[n] / sum;
    const double seen = in ? more : less;
    double pull = 0;
    double across = seen * density[n];
    if (std::isfinite(hit.range)) {
      score.on += seen * BeamNodes::weight[n];
      const double late = beam.hit() ? beam.range - hit.range : 0;
      const double alone = seen * (in ? 1 - wide : 1) * regular[n];
      const double together = in ? seen * wide * mixed : 0;
      score.regular += weight * (alone + together);
      score.chi2 += weight * (alone * late * late / variance +
                              together * mixed_late * mixed_late / mixed_variance);
      pull = alone * late / variance;
      if (in) {
        pull += seen * wide * mixed_pull;
        across += by_share;
      }
    }
    if (pull != 0) {
      pull *= weight;
      const Vector3d point = edge.rays[n].origin + hit.range * direction;
      const double facing = hit.normal.dot(direction);
      if (-facing > least_cosine) {
        // Of the face's motion, that which is not the edge's motion across the beam.
        const Vector3d own = pull / facing * hit.normal;
        const Vector3d shared =
            pull * hit.range / first.front / facing * (hit.normal - facing * direction);
        score.force += own - shared;
        score.torque += point.cross(own) - place.cross(shared);
      } else {
        score.force += pull * direction;
        score.torque += pull * point.cross(direction);
      }
    }
    const Vector3d moved = -3 * weight * across / first.front *
                           (BeamNodes::right[n] * per_right + BeamNodes::up[n] * per_up);
    sideways += moved;
    if (in) {
      inwards +=
          BeamNodes::weight[n] * (BeamNodes::right[n] * edge.right + BeamNodes::up[n] * edge.up);
    }
  }
  score.force += sideways;
  score.torque += place.cross(sideways);
  if (wide > 0 && inwards.squaredNorm() > 0) score.outwards = -sideways.dot(inwards.normalized());
  if (score.regular > 0) score.chi2 /= score.regular;
  return score;
}

}  // namespace berth::estimator
