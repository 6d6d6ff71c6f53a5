// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/run_measurements.h"

#include <algorithm>
#include <berth/arm_state_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <cmath>
#include <limits>
#include <map>

#include "common/core/error.h"
#include "common/core/statistics.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/good_estimate.h"
#include "testbed/calibration/tracker_file.h"

namespace berth {
namespace {

using testbed::ArmPair;
using testbed::CalibrationRun;
using testbed::JointTrack;

/// The arms rest when no joint is faster than this, rad/s or m/s.
constexpr double resting_rate = 1e-3;
constexpr double moving_rate = 5e-3;
/// Before a scan counts as made at rest: the estimator's own idea of the motion has died down.
constexpr double calming = 1.5;
/// About a scan, for the clocks' offsets.
constexpr double margin = 0.15;
/// m/s^2 and rad/s^2 of relative motion, up to which it counts as steady; s before a scan in which
/// it must have been.
constexpr double steady_linear = 0.012;
constexpr double steady_angular = radians(1.0);
constexpr double steadying = 1.0;
/// Estimates after an acquisition that have not converged yet.
constexpr int settling_estimates = 5;
/// Fewest scans of a pose, and of it all to know the scatter of one.
constexpr int min_scans = 4;

/// One estimate, as the log has it.
struct Estimate {
  double time = 0;
  double first_return = 0;
  double last_return = 0;
  Pose measured;
};

double fastest(const JointTrack::State& state) {
  double rate = 0;
  for (const double joint : state.rates) rate = std::max(rate, std::abs(joint));
  return rate;
}

/// The greatest rate of any joint between two times; nothing where the reports have a gap.
std::optional<double> fastest_between(const CalibrationRun& run, double from, double to) {
  constexpr double step = 0.04;
  double rate = 0;
  const int steps = static_cast<int>((to - from) / step);
  for (int i = 0; i <= steps; ++i) {
    for (const ArmRole role : testbed::both_arms) {
      const auto state = run.arm(role).at(from + i * step);
      if (!state) return std::nullopt;
      rate = std::max(rate, fastest(*state));
    }
  }
  return rate;
}

std::optional<Velocity> velocity_at(const CalibrationRun& run, const Cell& cell, double t) {
  constexpr double half = 0.05;
  const auto pose = [&](double at) -> std::optional<Pose> {
    const auto replica = run.replica.at(at);
    const auto sensor = run.sensor.at(at);
    if (!replica || !sensor) return std::nullopt;
    return cell.relative_pose(replica->joints, sensor->joints);
  };
  const auto before = pose(t - half);
  const auto after = pose(t + half);
  if (!before || !after) return std::nullopt;
  return velocity_between(*before, *after, 2 * half);
}

bool is_steady(const CalibrationRun& run, const Cell& cell, double from, double to) {
  constexpr int parts = 4;
  const auto first = velocity_at(run, cell, from);
  if (!first) return false;
  for (int i = 1; i <= parts; ++i) {
    const auto now = velocity_at(run, cell, from + (to - from) * i / parts);
    if (!now || (now->linear - first->linear).norm() > steady_linear * (to - from) ||
        (now->angular - first->angular).norm() > steady_angular * (to - from)) {
      return false;
    }
  }
  return true;
}

ArmPair joints_at(const CalibrationRun& run, double t) {
  return {run.replica.at(t)->joints, run.sensor.at(t)->joints};
}

Pose mean_of(const std::vector<Pose>& poses) {
  Pose mean = poses.front();
  for (int i = 0; i < 3; ++i) {
    Vector6d sum = Vector6d::Zero();
    for (const Pose& pose : poses) sum += difference(mean, pose);
    mean = perturbed(mean, sum / static_cast<double>(poses.size()));
  }
  return mean;
}

Matrix6d scatter_about(const Pose& mean, const std::vector<Pose>& poses) {
  Matrix6d scatter = Matrix6d::Zero();
  for (const Pose& pose : poses) {
    const Vector6d off = difference(mean, pose);
    scatter += off * off.transpose();
  }
  return scatter;
}

/// Scans of a target at rest, without outliers: there the estimator slid along the target, or took
/// something else for it.
std::vector<Pose> without_strays(const std::vector<Pose>& poses) {
  constexpr double far = 4;  // times the median distance: six sigmas
  Pose centre = poses.front();
  double min_spread = std::numeric_limits<double>::infinity();
  const auto distances = [&](const Pose& from, auto measure) {
    std::vector<double> list;
    for (const Pose& pose : poses) list.push_back(measure(from, pose));
    return list;
  };
  for (const Pose& pose : poses) {
    const double spread = upper_median(distances(pose, distance));
    if (spread < min_spread) {
      min_spread = spread;
      centre = pose;
    }
  }
  const double max_m = far * min_spread;
  const double max_rad = far * upper_median(distances(centre, angle_between));
  std::vector<Pose> kept;
  for (const Pose& pose : poses) {
    if (distance(centre, pose) <= max_m && angle_between(centre, pose) <= max_rad) {
      kept.push_back(pose);
    }
  }
  return kept;
}

/// Scans of one pose.
struct Group {
  ArmPair joints;
  double time = 0;
  std::vector<Pose> measured;
};

void add_scans(CalibrationRun& run, const Cell& cell, std::vector<Estimate> estimates,
               const SymmetryGroup& symmetry) {
  std::vector<Group> groups;
  std::vector<Estimate> moving;
  for (Estimate& estimate : estimates) {
    const auto now =
        fastest_between(run, estimate.first_return - margin, estimate.last_return + margin);
    if (!now) continue;
    // Of the poses that show the same target the one that the nominal cell means.
    const ArmPair joints = joints_at(run, estimate.time);
    estimate.measured = symmetry.nearest_equal(estimate.measured,
                                               cell.relative_pose(joints.replica, joints.sensor));
    if (*now > moving_rate) {
      if (is_steady(run, cell, estimate.first_return - steadying, estimate.last_return)) {
        moving.push_back(estimate);
      }
      continue;
    }
    const auto before = fastest_between(run, estimate.first_return - calming, estimate.last_return);
    if (!before || *before > resting_rate) continue;
    constexpr double same = 5e-5;  // rad: the reports' steps
    if (groups.empty() || testbed::max_change(groups.back().joints, joints) > same) {
      groups.push_back({joints, estimate.time, {}});
    }
    groups.back().measured.push_back(estimate.measured);
  }
  for (Group& group : groups) group.measured = without_strays(group.measured);
  std::erase_if(groups, [](const Group& group) {
    return static_cast<int>(group.measured.size()) < min_scans;
  });
  if (groups.empty()) throw InputError("no pose was measured at rest");

  Matrix6d pooled = Matrix6d::Zero();
  double freedom = 0;
  for (const Group& group : groups) {
    pooled += scatter_about(mean_of(group.measured), group.measured);
    freedom += static_cast<double>(group.measured.size() - 1);
  }
  if (freedom < 12) throw InputError("too few scans at rest to know how much they scatter");
  pooled /= freedom;

  int number = 0;
  for (const Group& group : groups) {
    const auto n = static_cast<double>(group.measured.size());
    const Pose mean = mean_of(group.measured);
    // Few scans determine their own scatter poorly: the scatter of all poses is a prior worth this
    // number of scans.
    constexpr double of_all = 12;
    const Matrix6d scatter =
        (scatter_about(mean, group.measured) + of_all * pooled) / (n - 1 + of_all);
    run.scans.push_back({"pose " + std::to_string(++number), group.time, mean, scatter / n, false});
  }
  for (const Estimate& estimate : moving) {
    run.scans.push_back({"motion", estimate.time, estimate.measured, pooled, true});
  }
}

void add_readings(CalibrationRun& run, const std::vector<testbed::TrackerLine>& lines,
                  const TrackerSetup& setup, double epoch) {
  struct Average {
    double time = 0;
    Vector3d point = Vector3d::Zero();
    int count = 0;
  };
  constexpr double moving_spacing = 0.05;     // s: neighbours are correlated
  std::map<std::size_t, double> last_moving;  // by reflector, s
  std::map<std::size_t, Average> averages;    // by reflector, of the rest under way
  ArmPair resting;
  int rests = 0;
  const auto close = [&] {
    for (const auto& [reflector, average] : averages) {
      const Reflector& on = setup.reflectors[reflector];
      const Vector3d point = average.point / average.count;
      run.readings.push_back({"rest " + std::to_string(rests) + ", " + on.name,
                              average.time / average.count, on.on, on.place, point,
                              setup.sigma_at(point.norm()) / std::sqrt(average.count), false});
    }
    averages.clear();
  };
  for (const testbed::TrackerLine& line : lines) {
    const double t = line.time - epoch;
    const auto rate = fastest_between(run, t - margin, t + margin);
    if (!rate) continue;
    const Reflector& reflector = setup.reflectors[line.reflector];
    if (*rate > moving_rate) {
      const auto [last, first] = last_moving.emplace(line.reflector, t);
      if (!first && t - last->second < moving_spacing) continue;
      last->second = t;
      run.readings.push_back({"motion, " + reflector.name, t, reflector.on, reflector.place,
                              line.point, setup.sigma_at(line.point.norm()), true});
      continue;
    }
    if (*rate > resting_rate) continue;
    const ArmPair joints = joints_at(run, t);
    if (averages.empty() || testbed::max_change(resting, joints) > 5e-5) {
      close();
      resting = joints;
      ++rests;
    }
    Average& average = averages[line.reflector];
    average.time += t;
    average.point += line.point;
    ++average.count;
  }
  close();
  if (run.readings.empty()) {
    throw InputError("no reading of the tracker falls into the run: is its time the host's?");
  }
}

}  // namespace

CalibrationRun read_calibration_run(const std::filesystem::path& log, const Cell& nominal,
                                    const TrackerSetup& setup,
                                    const std::filesystem::path& tracker_file) {
  CalibrationRun run;
  std::vector<Estimate> estimates;
  Utime epoch = 0;
  int good = 0;  // estimates in a row
  std::optional<std::int64_t> session;
  const auto since = [&](Utime t) { return seconds(t - epoch); };
  evaluation::LogSummary summary;
  const auto visit = [&](const logs::LogEvent& event) {
    if (epoch == 0) epoch = event.utime;
    for (const auto& [channel, track] : {std::pair(channels::arm_state_replica, &run.replica),
                                         std::pair(channels::arm_state_sensor, &run.sensor)}) {
      const auto state = logs::decode<arm_state_t>(event, channel);
      if (const auto joints = reported_joints(state)) track->add(since(state->utime), *joints);
    }
    if (const auto e = logs::decode<pose_estimate_t>(event, channels::pose_estimate)) {
      good = is_good(*e) ? good + 1 : 0;
      if (good <= settling_estimates || e->operating_range == pose_estimate_t::RANGE_LONG) return;
      Estimate estimate;
      estimate.time = since(e->utime);
      estimate.first_return = since(e->utime_first_return);
      estimate.last_return = since(e->utime_last_return);
      estimate.measured = pose_of(e->measured_position_m, e->measured_q_wxyz);
      if (!estimate.measured.position.allFinite()) return;
      estimates.push_back(estimate);
    }
  };
  const evaluation::RunRecord record = evaluation::read_run(log, summary, session, visit);
  const SymmetryGroup symmetry =
      record.info() ? evaluation::symmetry_of_run(*record.info()) : SymmetryGroup();
  if (run.replica.empty() || run.sensor.empty() || estimates.empty()) {
    throw InputError(log.string() + ": holds no joints of both arms at the times of estimates");
  }
  try {
    add_scans(run, nominal, std::move(estimates), symmetry);
    if (!tracker_file.empty()) {
      add_readings(run, testbed::read_tracker_file(tracker_file, setup), setup, seconds(epoch));
    }
  } catch (const InputError& e) {
    throw InputError(log.string() + ": " + e.what());
  }
  return run;
}

std::vector<std::string> poses_left_out(const std::filesystem::path& log) {
  std::vector<procedure_step_t> steps;
  evaluation::LogSummary summary;
  std::optional<std::int64_t> session;
  evaluation::read_run(log, summary, session, [&](const logs::LogEvent& event) {
    const auto state = logs::decode<procedure_state_t>(event, channels::procedure_state);
    if (state && state->state == procedure_state_t::FINISHED) steps = state->steps;
  });
  const std::string waiting = "dwell (";
  std::vector<std::string> list;
  for (const procedure_step_t& step : steps) {
    const bool waited = step.name.rfind(waiting, 0) == 0 && step.name.back() == ')';
    if (!waited || step.state == procedure_step_t::PASSED) continue;
    list.push_back(step.name.substr(waiting.size(), step.name.size() - waiting.size() - 1) + ": " +
                   (step.detail.empty() ? "not come to" : step.detail));
  }
  return list;
}

}  // namespace berth
