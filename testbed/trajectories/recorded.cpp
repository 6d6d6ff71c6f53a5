// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/trajectories/recorded.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>

#include "common/core/error.h"
#include "common/core/text.h"

namespace berth::testbed {
namespace {

constexpr std::array<const char*, 7> names = {"t", "x", "y", "z", "w", "p", "r"};
using Columns = std::array<std::size_t, 7>;

std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else if (c != ' ' && c != '\t' && c != '\r' && c != '"') {
      fields.back() += c;
    }
  }
  return fields;
}

Columns columns_of(const std::string& line, const std::string& place) {
  const auto fields = fields_of(line);
  Columns columns{};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto found = std::find(fields.begin(), fields.end(), names[i]);
    if (found == fields.end()) {
      throw InputError(place + ": found '" + line + "', expected a line that names the columns " +
                       "t,x,y,z,w,p,r (s, mm, deg); '" + names[i] + "' is missing");
    }
    columns[i] = static_cast<std::size_t>(found - fields.begin());
  }
  return columns;
}

double number_of(const std::vector<std::string>& fields, std::size_t column, const char* name,
                 const std::string& place) {
  const std::string text = column < fields.size() ? fields[column] : "";
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    throw InputError(place + ": found '" + text + "' for " + name + ", expected a number");
  }
  return value;
}

/// Refuses neighbours too far apart for interpolation.
void check_step(const WaypointPath::Waypoint& a, const WaypointPath::Waypoint& b,
                const std::string& place) {
  if (b.time <= a.time) throw InputError(place + ": is not later than the line before");
  const double angle = angle_between(a.pose, b.pose);
  if (angle > radians(45)) {
    throw InputError(place + ": turns by " + fixed(degrees(angle), 0) +
                     " deg since the line before, expected at most 45 deg");
  }
}

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

Waypoints read_poses(const std::string& text, const std::string& name) {
  std::istringstream lines(text);
  Waypoints waypoints;
  Columns columns{};
  bool named = false;
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos || line.front() == '#') continue;
    const std::string place = name + ":" + std::to_string(number);
    if (!named) {
      columns = columns_of(line, place);
      named = true;
      continue;
    }
    const auto fields = fields_of(line);
    std::array<double, 7> values{};
    for (std::size_t i = 0; i < names.size(); ++i) {
      values[i] = number_of(fields, columns[i], names[i], place);
    }
    const Pose pose =
        pose_from_xyzwpr({values[1], values[2], values[3], values[4], values[5], values[6]});
    const WaypointPath::Waypoint waypoint{values[0], pose};
    if (!waypoints.empty()) check_step(waypoints.back(), waypoint, place);
    waypoints.push_back(waypoint);
  }
  if (waypoints.size() < 2) {
    throw InputError(name + ": found " + std::to_string(waypoints.size()) +
                     " poses, expected at least two");
  }
  const double start = waypoints.front().time;
  for (auto& waypoint : waypoints) waypoint.time -= start;
  return waypoints;
}

/// To 0.1 um and 2 urad.
std::string trajectory_text(const Waypoints& waypoints) {
  std::string text = "t,x,y,z,w,p,r\n";
  for (const auto& [time, pose] : waypoints) {
    text += fixed(time, 4);
    for (const double value : xyzwpr_from_pose(pose)) text += "," + fixed(value, 4);
    text += "\n";
  }
  return text;
}

Waypoints read_trajectory_text(const std::string& text, const std::string& name,
                               const TrajectoryFile& options) {
  Waypoints waypoints = read_poses(text, name);
  if (options.ramp <= 0) {
    if (waypoints.size() <= max_waypoints) return waypoints;
    throw InputError(name + ": found " + std::to_string(waypoints.size()) +
                     " poses, expected at most " + std::to_string(max_waypoints) +
                     ", or a ramp, with which it is sampled anew");
  }
  const WaypointPath path(waypoints, WaypointPath::Ends::under_way);
  const SmoothTravel time = eased_time(path.duration(), options.ramp);
  return sampled([&](double t) { return path.at(time.position(t)).pose; }, time.duration());
}

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
    // sparser samples than requested: the neighbours
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
