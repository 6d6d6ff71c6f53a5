// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/motion_planner.h"

#include <algorithm>
#include <cmath>

namespace berth::testbed {
namespace {

/// Number of places of a path at which a resolution is evaluated, and of steps between them that
/// keep the branch.
constexpr int places = 12;
constexpr int steps_between = 3;
constexpr int clearance_every = 3;  // places
/// A joint that turns farther in one step has changed its branch, rad.
constexpr double leap = 0.8;

// Margins at which a criterion counts as fully met.
constexpr double plenty_of_joint = 0.35;           // rad to a limit
constexpr double plenty_of_manipulability = 0.13;  // above its limit
constexpr double plenty_of_speed = 3;              // times the speed of the path
constexpr double plenty_of_room = 0.15;            // m beyond the limit of clearance
/// Value of a violated margin: above 0, so that the search can still compare resolutions.
constexpr double hardly_any = 0.02;

constexpr int max_evaluations = 150;
constexpr std::size_t seeds_refined = 2;

/// Number of parameters of a search, each with its own step.
constexpr std::size_t dimensions = 11;
using Point = std::array<double, dimensions>;
constexpr Point first_steps = {0.25, 0.25, 0.2, 0.2, 0.2, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1};
constexpr Point farthest = {1, 1, 0.8, 1.0, 0.5, 0.5, 0.5, 0.5, 0.4, 0.4, 0.4};

Point point_of(const RedundancyResolution& s) {
  return {s.travel,    s.lateral,   s.shift.x(), s.shift.y(), s.shift.z(), s.bulge.x(),
          s.bulge.y(), s.bulge.z(), s.turn.x(),  s.turn.y(),  s.turn.z()};
}

RedundancyResolution resolution_of(const Point& p) {
  return {p[0], p[1], {p[2], p[3], p[4]}, {p[5], p[6], p[7]}, {p[8], p[9], p[10]}};
}

/// Starting points of the search in addition to the nominal resolution: both arms aside, up, down,
/// along.
std::vector<RedundancyResolution> seeds(const RedundancyResolution& nominal) {
  std::vector<RedundancyResolution> list;
  for (const double side : {0.0, 0.3, -0.4, -0.8}) {
    for (const double up : {0.0, 0.25, -0.25}) {
      for (const double lateral : {0.0, 0.5}) {
        RedundancyResolution resolution = nominal;
        resolution.lateral = lateral;
        resolution.shift = Vector3d(0, side, up);
        list.push_back(resolution);
      }
    }
  }
  return list;
}

/// Maximum number of resolutions checked in full in addition to the nominal one.
constexpr std::size_t max_checks = 5;

}  // namespace

double RedundancySearch::margin(const ArmPair& before, const ArmPair& joints, double dt,
                                bool clearance) const {
  double least = 1;
  for (const ArmRole role : both_arms) {
    const ArmKinematics& arm = *cell_.arm(role).kinematics;
    const Joints& q = joints.of(role);
    const Joints motors = arm.motor_joints(q);
    const Joints motors_before = arm.motor_joints(before.of(role));
    for (std::size_t i = 0; i < 6; ++i) {
      const JointLimit& limit = arm.limits()[i];
      const double turned =
          std::max(std::abs(q[i] - before.of(role)[i]), std::abs(motors[i] - motors_before[i]));
      if (turned > 0) {
        // a hold anywhere must stay within the acceleration
        const double holdable = limits_.rates.acceleration * limit.acceleration /
                                (0.37 * TimeScale::frequency(limits_.rates.hold_settling));
        const double most = std::min(limits_.rates.speed * limit.speed, holdable);
        least = std::min(least, most * dt / turned / plenty_of_speed);
      }
      if (arm.is_linear(static_cast<int>(i))) continue;
      least = std::min(
          {least, (q[i] - limit.low) / plenty_of_joint, (limit.high - q[i]) / plenty_of_joint});
    }
    least = std::min(least,
                     (arm.manipulability(q) - limits_.manipulability) / plenty_of_manipulability);
  }
  if (clearance && least > hardly_any) {
    // an arm's own parts are always near each other: they only must not come too near
    if (clearance_.worst(joints, 0.01).slack < 0) return hardly_any;
    const double limit = clearance_.limits().between;
    const auto nearest = clearance_.nearest(joints, limit + plenty_of_room);
    least = std::min(least, (nearest.slack - limit) / plenty_of_room);
  }
  return std::max(least, hardly_any);
}

double RedundancySearch::quality(const RelativePath& path, const ArmPair& start,
                                 const RedundancyResolution& resolution) const {
  const ArmAllocation allocation(cell_, resolution, FrozenArm::none, start);
  const double dt = path.duration() / (places * steps_between);
  ArmPair near = start;
  double sum = 0;
  for (int k = 1; k <= places * steps_between; ++k) {
    const RelativePath::Point point = path.at(k * dt);
    const auto joints = allocation.joints(point.pose, point.progress, near, nullptr);
    const bool can = joints && max_change(near, *joints) < leap &&
                     cell_.replica.kinematics->limit_violation(joints->replica).empty() &&
                     cell_.sensor.kinematics->limit_violation(joints->sensor).empty();
    if (!can) return static_cast<double>(k) / (places * steps_between) - 1;
    if (k % steps_between == 0) {
      const bool clearance = (k / steps_between) % clearance_every == 0;
      sum += std::pow(margin(near, *joints, dt, clearance), -4);
    }
    near = *joints;
  }
  return std::pow(sum / places, -0.25);
}

std::vector<RedundancySearch::Found> RedundancySearch::best(
    const RelativePath& path, const ArmPair& start, const RedundancyResolution& nominal) const {
  std::vector<Found> found;
  for (const RedundancyResolution& seed : seeds(nominal))
    found.push_back({seed, quality(path, start, seed)});
  const auto better = [](const Found& a, const Found& b) { return a.quality > b.quality; };
  std::stable_sort(found.begin(), found.end(), better);
  int evaluations = 0;
  for (std::size_t n = 0; n < seeds_refined; ++n) {
    Point here = point_of(found[n].resolution);
    double quality_here = found[n].quality;
    for (double scale = 1; scale > 0.2 && quality_here < comfortable;) {
      bool improved = false;
      for (std::size_t i = 0; i < dimensions; ++i) {
        for (const double sign : {1.0, -1.0}) {
          Point next = here;
          next[i] = std::clamp(next[i] + sign * scale * first_steps[i], i < 2 ? 0 : -farthest[i],
                               farthest[i]);
          if (next[i] == here[i]) continue;
          const double quality_next = quality(path, start, resolution_of(next));
          ++evaluations;
          if (quality_next <= quality_here) continue;
          here = next;
          quality_here = quality_next;
          improved = true;
          break;
        }
      }
      if (!improved) scale /= 2;
      if (evaluations > max_evaluations * static_cast<int>(n + 1)) break;
    }
    found.push_back({resolution_of(here), quality_here});
  }
  std::stable_sort(found.begin(), found.end(), better);
  return found;
}

MotionPlanner::Result MotionPlanner::plan(std::shared_ptr<const RelativePath> path,
                                          const ArmPair& start, FrozenArm frozen) const {
  std::optional<Refusal> refusal;
  const auto attempt = [&](const RedundancyResolution& resolution) -> std::optional<Plan> {
    Plan plan{std::make_shared<const RelativeMotion>(
                  path, ArmAllocation(cell_, resolution, frozen, start)),
              resolution};
    const auto wrong = check_.check(*plan.motion, start);
    if (!wrong) return plan;
    if (!refusal || wrong->passing_rate > refusal->passing_rate) refusal = wrong;
    return std::nullopt;
  };
  RedundancyResolution nominal;
  nominal.travel = cell_.sensor_share;
  // a frozen arm leaves no redundancy, and neither does a motion without duration
  const bool choice = frozen == FrozenArm::none && path->duration() > 0;
  if (!choice || search_.quality(*path, start, nominal) >= RedundancySearch::comfortable) {
    if (auto plan = attempt(nominal)) return *std::move(plan);
    if (!choice) return *refusal;
  }
  std::vector<RedundancySearch::Found> found = search_.best(*path, start, nominal);
  if (found.size() > max_checks) found.resize(max_checks);
  for (const auto& [resolution, quality] : found) {
    if (quality < 0) break;
    if (auto plan = attempt(resolution)) return *std::move(plan);
  }
  if (auto plan = attempt(nominal)) return *std::move(plan);
  return *refusal;
}

}  // namespace berth::testbed
