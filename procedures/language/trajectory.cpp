// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/trajectory.h"

#include <algorithm>
#include <berth/testbed_state_t.hpp>
#include <filesystem>

#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/text.h"
#include "evaluation/run/run_record.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "procedures/language/source.h"
#include "testbed/trajectories/recorded.h"
#include "testbed/trajectories/trajectory.h"

namespace berth::procedures {
namespace {

/// s, longest gap in a record that may be interpolated.
constexpr double max_gap = 1;

std::filesystem::path log_of(const std::filesystem::path& run) {
  return std::filesystem::is_directory(run) ? run / "run.lcm" : run;
}

/// Relative poses of an earlier run, with their times in s from the first one: where the replica
/// was (GROUND_TRUTH), or its commanded poses (TESTBED_STATE).
/// @param run a run directory, or its log
/// @param phase_name of that run; empty: the whole of it
/// @throws InputError, also when the record has holes.
testbed::Waypoints poses_of_run(const std::filesystem::path& run, const std::string& phase_name,
                                bool commanded) {
  const std::filesystem::path file = log_of(run);
  std::vector<std::pair<Utime, Pose>> poses;
  evaluation::LogSummary summary;
  const evaluation::RunRecord record =
      evaluation::read_run(file, summary, std::nullopt, [&](const logs::LogEvent& event) {
        if (!commanded) return;
        const auto state = logs::decode<testbed_state_t>(event, channels::testbed_state);
        if (!state) return;
        poses.emplace_back(state->utime,
                           exact_pose_of(state->commanded_position_m, state->commanded_q_wxyz));
      });
  if (!commanded) {
    for (const auto& sample : record.truth().samples())
      poses.emplace_back(sample.utime, sample.pose);
  }
  const auto phase = record.phase(phase_name.empty() ? evaluation::whole_run : phase_name);
  if (!phase) {
    std::string known;
    for (const evaluation::Phase& p : record.phases())
      known += (known.empty() ? "" : ", ") + p.name;
    throw InputError(file.string() + ": has no phase '" + phase_name + "'" +
                     (known.empty() ? "" : "; its phases are: " + known));
  }
  testbed::Waypoints samples;
  for (const auto& [utime, pose] : poses) {
    if (!phase->contains(utime)) continue;
    const double time = seconds(utime - phase->start());
    if (!samples.empty() && time <= samples.back().time) continue;
    if (!samples.empty() && time - samples.back().time > max_gap) {
      throw InputError(file.string() + ": where the replica was is not recorded from " +
                       fixed(samples.back().time, 1) + " s to " + fixed(time, 1) + " s of '" +
                       phase->name + "'");
    }
    samples.push_back({time, pose});
  }
  if (samples.size() < 2) {
    throw InputError(file.string() + ": holds " + std::to_string(samples.size()) +
                     " relative poses in '" + phase->name + "', expected at least two");
  }
  return samples;
}

using testbed::Waypoints;

/// A trajectory that a function of testbed makes from its options, wherever it begins.
template <class Options>
Trajectory made_by(Waypoints (*make)(const Pose&, const Options&), const Options& options) {
  return {[=](const Pose& here) { return make(here, options); }, make(Pose{}, options).back().time};
}

void read_ramp(Config& config, double& ramp) {
  config.optional("ramp", Dimension::time, ramp, above(0));
}

void read_axis(Config& config, Vector3d& axis) {
  if (config.has("axis")) axis = config.vector("axis", Dimension::number);
  if (!(axis.norm() > 1e-6)) throw config.error("axis", "expected a direction, found no length");
}

Trajectory read_waypoints(Config& trajectory) {
  Waypoints waypoints;
  for (Config& section : trajectory.sections("waypoints")) {
    const double at = section.quantity("at", Dimension::time);
    const Pose pose = section.pose("pose");
    section.finish();
    if (!waypoints.empty() && at <= waypoints.back().time) {
      throw section.error("at", "must be later than the waypoint before");
    }
    waypoints.push_back({at, pose});
  }
  if (waypoints.empty()) throw trajectory.error("waypoints", "expected at least one");
  if (waypoints.size() > testbed::max_waypoints) {
    throw trajectory.error("waypoints",
                           "expected at most " + std::to_string(testbed::max_waypoints));
  }
  const double end = waypoints.back().time;
  return {[waypoints = std::move(waypoints)](const Pose&) { return waypoints; }, end};
}

/// The text attached to the rule; without one the text that `read` gives, which is then attached.
template <class Reader>
std::string attached(Config& rule, const Reader& read) {
  if (!rule.has(attached_key)) {
    YamlNode node = rule.node();  // shares its content
    node.put(attached_key, read(std::filesystem::path(rule.file()).parent_path()));
  }
  return rule.raw(attached_key).text();
}

Trajectory read_file_rule(Config& config) {
  testbed::TrajectoryFile options;
  const std::filesystem::path name = config.text("name");
  config.optional("ramp", Dimension::time, options.ramp, at_least(0));
  try {
    const std::string text = attached(config, [&](const std::filesystem::path& folder) {
      return clean_text(read_file(folder / name), name.string());
    });
    Waypoints waypoints = testbed::read_trajectory_text(text, name.string(), options);
    const double end = waypoints.back().time;
    return {[waypoints = std::move(waypoints)](const Pose&) { return waypoints; }, end};
  } catch (const InputError& e) {
    throw config.error("name", e.what());
  }
}

Trajectory read_log_rule(Config& config) {
  testbed::Recorded options;
  const std::filesystem::path run = config.text("run");
  std::string phase;
  config.optional("phase", phase);
  std::string of = "truth";
  if (config.has("of")) of = config.choice("of", {"truth", "commanded"});
  double spacing = 0.25;
  config.optional("spacing", Dimension::time, spacing, above(0));
  config.optional("speed", Dimension::speed, options.speed, above(0));
  config.optional("turn", Dimension::angular_speed, options.angular_speed, above(0));
  read_ramp(config, options.ramp);
  try {
    const std::string text = attached(config, [&](const std::filesystem::path& folder) {
      const Waypoints samples = poses_of_run(folder / run, phase, of == "commanded");
      return testbed::trajectory_text(testbed::smoothed(samples, spacing));
    });
    options.places = testbed::read_poses(text, run.string());
  } catch (const InputError& e) {
    throw config.error("run", e.what());
  }
  return {[=](const Pose& here) { return testbed::recorded(here, options); }, 0};
}

Trajectory read_straight(Config& config) {
  testbed::Straight options;
  options.by = config.pose("by");
  config.optional("speed", Dimension::speed, options.speed, above(0));
  config.optional("turn", Dimension::angular_speed, options.angular_speed, above(0));
  read_ramp(config, options.ramp);
  if (distance(Pose{}, options.by) < 1e-6 && angle_between(Pose{}, options.by) < 1e-6) {
    throw config.error("by", "goes nowhere");
  }
  return made_by(testbed::straight, options);
}

Trajectory read_bar(Config& config, const Vector3d& bulge_along) {
  testbed::BarApproach options;
  options.to = config.quantity("to", Dimension::length, above(0));
  if (config.has("holds")) options.holds = config.quantities("holds", Dimension::length);
  config.optional("hold_for", Dimension::time, options.hold_for, above(0));
  config.optional("speed", Dimension::speed, options.speed, above(0));
  config.optional("bulge", Dimension::length, options.bulge);
  read_ramp(config, options.ramp);
  options.bulge_along = bulge_along;
  return {[=](const Pose& here) { return testbed::bar_approach(here, options); }, 0};
}

Trajectory read_v_bar(Config& config) { return read_bar(config, Vector3d::UnitY()); }
Trajectory read_r_bar(Config& config) { return read_bar(config, Vector3d::UnitX()); }

Trajectory read_oscillation(Config& config) {
  testbed::Oscillation options;
  read_axis(config, options.axis);
  options.amplitude = config.quantity("amplitude", Dimension::length, above(0));
  options.speed = config.quantity("speed", Dimension::speed, above(0));
  config.optional("cycles", options.cycles, at_least(1));
  read_ramp(config, options.ramp);
  return made_by(testbed::oscillation, options);
}

Trajectory read_spiral(Config& config) {
  testbed::Spiral options;
  options.radius = config.quantity("radius", Dimension::length, above(0));
  config.optional("turns", options.turns, above(0));
  config.optional("speed", Dimension::speed, options.speed, above(0));
  read_ramp(config, options.ramp);
  return made_by(testbed::spiral, options);
}

Trajectory read_drift(Config& config) {
  testbed::Drift options;
  config.optional("amplitude", Dimension::length, options.amplitude, above(0));
  config.optional("turn", Dimension::angle, options.turn, at_least(0));
  config.optional("period", Dimension::time, options.period, above(0));
  options.duration = config.quantity("duration", Dimension::time, above(0));
  read_ramp(config, options.ramp);
  return made_by(testbed::drift, options);
}

Trajectory read_fly_around(Config& config) {
  testbed::FlyAround options;
  options.angle = config.quantity("angle", Dimension::angle);
  if (options.angle == 0) throw config.error("angle", "goes nowhere");
  read_axis(config, options.axis);
  config.optional("speed", Dimension::angular_speed, options.speed, above(0));
  read_ramp(config, options.ramp);
  return made_by(testbed::fly_around, options);
}

Trajectory read_tumble(Config& config) {
  testbed::Tumble options;
  options.inertia = config.vector("inertia", Dimension::number);
  const Vector3d& i = options.inertia;
  if (!(i.minCoeff() > 0) || 2 * i.maxCoeff() > i.sum() * (1 + 1e-9)) {
    throw config.error("inertia",
                       "no body has such moments: all must be positive, and none greater than the "
                       "other two together");
  }
  options.rate = config.vector("rate", Dimension::angular_speed);
  if (options.rate.norm() == 0) throw config.error("rate", "a body that does not turn");
  options.duration = config.quantity("duration", Dimension::time, above(0));
  read_ramp(config, options.ramp);
  return made_by(testbed::tumble, options);
}

struct Rule {
  KeyInfo key;
  Trajectory (*read)(Config& config);
};

const KeyInfo ramp_key = {"ramp", Kind::time, false, "2 s", "from rest to full speed, and back"};

KeyInfo speed_key(const char* default_value) {
  return {"speed", Kind::speed, false, default_value, "the greatest"};
}

KeyInfo axis_key(const char* default_value) {
  return {"axis", Kind::vector, false, default_value, "sensor frame"};
}

std::vector<KeyInfo> bar_keys(const char* bulges) {
  return {{"to", Kind::length, true, "", "z of the replica's origin at the end"},
          {"holds", Kind::lengths, false, "none", "z of the hold points, in order"},
          {"hold_for", Kind::time, false, "10 s", "at each of them"},
          speed_key("30 mm/s"),
          {"bulge", Kind::length, false, "0 mm",
           std::string("out of the line, half way between two hold points, along ") + bulges},
          ramp_key};
}

KeyInfo rule_key(const char* name, const char* description, std::vector<KeyInfo> keys) {
  KeyInfo key{name, Kind::map, false, "", description};
  key.keys = std::move(keys);
  return key;
}

const std::vector<Rule>& rules() {
  static const std::vector<Rule> all = {
      {{"waypoints", Kind::waypoints, false, "", "a list of {at: TIME, pose: [x, y, z, w, p, r]}"},
       read_waypoints},
      {rule_key("file", "a CSV file with the columns t,x,y,z,w,p,r",
                {{"name", Kind::text, true, "", "seen from the procedure's folder"},
                 {"ramp", Kind::time, false, "2 s", "0 s: it begins and ends at rest by itself"}}),
       read_file_rule},
      {rule_key("log", "as it went in an earlier run, from its log",
                {{"run", Kind::text, true, "", "run directory, seen from the procedure's folder"},
                 {"phase", Kind::text, false, "all of it", "of that run"},
                 {"of", Kind::text, false, "truth", "truth, or commanded"},
                 {"spacing", Kind::time, false, "250 ms", "what is quicker counts as noise"},
                 {"speed", Kind::speed, false, "50 mm/s", "straight to where it begins"},
                 {"turn", Kind::angular_speed, false, "5 deg/s", "on the way there"},
                 ramp_key}),
       read_log_rule},
      {rule_key("straight", "on by a displacement",
                {{"by", Kind::pose, true, "", "along and about the sensor's axes"},
                 speed_key("50 mm/s"),
                 {"turn", Kind::angular_speed, false, "5 deg/s", "the greatest"},
                 ramp_key}),
       read_straight},
      {rule_key("v_bar", "along the line of sight, with hold points", bar_keys("R-bar (y, down)")),
       read_v_bar},
      {rule_key("r_bar", "along the line of sight, with hold points", bar_keys("V-bar (x)")),
       read_r_bar},
      {rule_key("oscillation", "to and fro along an axis, as a sine",
                {axis_key("[1, 0, 0]"),
                 {"amplitude", Kind::length, true, "", "to either side"},
                 {"speed", Kind::speed, true, "", "at the middle, the greatest"},
                 {"cycles", Kind::count, false, "4", "there and back, on both sides"},
                 ramp_key}),
       read_oscillation},
      {rule_key("spiral", "outwards across the boresight, at constant speed",
                {{"radius", Kind::length, true, "", "at the end"},
                 {"turns", Kind::number, false, "2", "about the boresight"},
                 speed_key("50 mm/s"),
                 ramp_key}),
       read_spiral},
      {rule_key("drift", "slow wandering, as of a vehicle in its dead band",
                {{"amplitude", Kind::length, false, "20 mm", "of each axis"},
                 {"turn", Kind::angle, false, "1 deg", "about each axis"},
                 {"period", Kind::time, false, "20 s", "of the fastest axis"},
                 {"duration", Kind::time, true, "", "without the ramps"},
                 {"ramp", Kind::time, false, "4 s", "from rest to full rate, and back"}}),
       read_drift},
      {rule_key("fly_around", "the replica turns as a chaser sees it that flies around it",
                {{"angle", Kind::angle, true, "", "right-handed about the axis"},
                 axis_key("[0, 1, 0]"),
                 {"speed", Kind::angular_speed, false, "2 deg/s", "the greatest"},
                 ramp_key}),
       read_fly_around},
      {rule_key("tumble", "a rigid body that nothing acts upon",
                {{"inertia", Kind::vector, true, "", "about the model's axes; ratios matter"},
                 {"rate", Kind::vector, true, "", "[x, y, z] at the start, about the model's axes"},
                 {"duration", Kind::time, true, "", "without the ramps"},
                 ramp_key}),
       read_tumble},
  };
  return all;
}

}  // namespace

const std::vector<KeyInfo>& trajectory_keys() {
  static const std::vector<KeyInfo> keys = [] {
    std::vector<KeyInfo> list;
    for (const Rule& rule : rules()) list.push_back(rule.key);
    return list;
  }();
  return keys;
}

Trajectory read_trajectory(Config& step, const std::string& key) {
  Config config = step.section(key);
  std::string known;
  const Rule* found = nullptr;
  for (const Rule& rule : rules()) {
    known += (known.empty() ? "" : ", ") + rule.key.key;
    if (!config.has(rule.key.key)) continue;
    if (found != nullptr) {
      throw config.error(rule.key.key, "a trajectory has one rule, and this one has '" +
                                           found->key.key + "' already");
    }
    found = &rule;
  }
  for (const std::string& name : config.keys()) {
    const bool is_rule = std::any_of(rules().begin(), rules().end(),
                                     [&](const Rule& rule) { return rule.key.key == name; });
    if (!is_rule) throw config.error(name, "is no rule of a trajectory; rules are: " + known);
  }
  if (found == nullptr) throw step.error(key, "expected one of: " + known);
  if (found->key.kind != Kind::map) return found->read(config);
  Config rule = config.section(found->key.key);
  Trajectory trajectory = found->read(rule);
  rule.finish();
  config.finish();
  return trajectory;
}

}  // namespace berth::procedures
