// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/plane_segments.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/acquire/image_regions.h"
#include "estimator/acquire/pose_odds.h"

namespace berth::estimator {
namespace {

constexpr double off_sigmas = 3;   // of a return, from its plane
constexpr double min_slope = 0.1;  // cosine: flatter than that, nothing is on it
constexpr int seed_steps = 2;      // to each side of where a plane begins
constexpr std::size_t min_seed = 8;

}  // namespace

PlaneSegments plane_segments(const RangeImage& image, const std::vector<char>& among) {
  const auto& beams = image.beams();
  PlaneSegments result;
  result.of_beam.assign(beams.size(), -1);
  const auto free = [&](int b) {
    const auto at = static_cast<std::size_t>(b);
    return among[at] != 0 && beams[at].hit() && result.of_beam[at] < 0;
  };
  const auto on = [&](int b, const FittedPlane& plane) {
    const Beam& beam = beams[static_cast<std::size_t>(b)];
    const Vector3d normal = plane.axes.col(0);
    const double slope = normal.dot(beam.direction);
    if (std::abs(slope) < min_slope) return false;
    const double variance = range_variance(image.noise(), 0, beam.range, std::abs(slope));
    const double off = beam.range - normal.dot(plane.mean) / slope;
    return std::abs(off) < off_sigmas * std::sqrt(variance);
  };
  for (int start = 0; start < static_cast<int>(beams.size()); ++start) {
    if (!free(start)) continue;
    std::vector<int> members;
    for_each_about(image, start, seed_steps, [&](int b) {
      if (free(b)) members.push_back(b);
    });
    if (members.size() < min_seed) continue;
    FittedPlane plane = plane_through(image, members);
    if (!std::all_of(members.begin(), members.end(), [&](int b) { return on(b, plane); })) continue;
    // A plane through few beams is turned by their noise: by those that it then holds, again.
    for (std::size_t before = 0;; before = members.size()) {
      std::vector<char> marked(beams.size());
      for (std::size_t b = 0; b < marked.size(); ++b) marked[b] = free(static_cast<int>(b)) ? 1 : 0;
      members = connected(image, marked, start, 1, [&](int, int b) { return on(b, plane); });
      if (members.size() < min_seed || 10 * members.size() < 11 * before) break;
      plane = plane_through(image, members);
    }
    if (members.size() < 3 * min_seed) continue;
    for (const int b : members) {
      result.of_beam[static_cast<std::size_t>(b)] = static_cast<int>(result.nats.size());
    }
    const double known =
        image.noise().range_sigma_m * std::sqrt(3 / static_cast<double>(members.size()));
    result.nats.push_back(
        std::max(0.0, 3 * std::log(image.depth() / known) - 1.5 * std::log(2 * std::numbers::pi)));
  }
  return result;
}

}  // namespace berth::estimator
