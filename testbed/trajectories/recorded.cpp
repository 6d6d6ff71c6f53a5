// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/trajectories/recorded.h"

#include <algorithm>
#include <cmath>

namespace berth::testbed {
namespace {

/// At `time`, by a least-squares line through the samples first .. last - 1.
Pose fitted(const Waypoints& samples, std::size_t first, std::size_t last, double time) {
  const Pose& reference = samples[(first + last) / 2].pose;
  const auto count = static_cast<double>(last - first);
  double mean_time = 0;
  Vector6d mean = Vector6d::Zero();
  for (std::size_t i = first; i < last; ++i) {
    mean_time += samples[i].time / count;
    mean += difference(reference, samples[i].pose) / count;
  }
  double spread = 0;
  Vector6d slope = Vector6d::Zero();
  for (std::size_t i = first; i < last; ++i) {
    const double off = samples[i].time - mean_time;
    spread += off * off;
    slope += off * (difference(reference, samples[i].pose) - mean);
  }
  if (spread > 0) slope /= spread;
  return perturbed(reference, mean + (time - mean_time) * slope);
}

}  // namespace

Waypoints smoothed(const Waypoints& samples, double spacing) {
  const double start = samples.front().time;
  const double duration = samples.back().time - start;
  const int count = std::max(1, static_cast<int>(std::floor(duration / spacing)));
  Waypoints places;
  const auto later = [](const WaypointPath::Waypoint& sample, double t) { return sample.time < t; };
  for (int k = 0; k <= count; ++k) {
    const double time = start + duration * k / count;
    auto first = std::lower_bound(samples.begin(), samples.end(), time - spacing, later);
    auto last = std::lower_bound(first, samples.end(), time + spacing, later);
    // thinner samples than asked for: the neighbours
    if (first == samples.end()) --first;
    if (last == first) ++last;
    places.push_back(
        {time - start, fitted(samples, static_cast<std::size_t>(first - samples.begin()),
                              static_cast<std::size_t>(last - samples.begin()), time)});
  }
  return places;
}

Waypoints recorded(const Pose& from, const Recorded& options) {
  const WaypointPath path(options.places, WaypointPath::Ends::under_way);
  const Pose begin = path.at(0).pose;
  const StraightPath there(from, begin,
                           {options.speed, options.angular_speed, options.speed / options.ramp,
                            options.angular_speed / options.ramp, options.ramp});
  const SmoothTravel time = eased_time(path.duration(), options.ramp);
  return sampled(
      [&](double t) {
        return t < there.duration() ? there.at(t).pose
                                    : path.at(time.position(t - there.duration())).pose;
      },
      there.duration() + time.duration());
}

}  // namespace berth::testbed
