// SPDX-License-Identifier: BSD-3-Clause
// TESTBED_COMMAND: who may ask for what, and how a motion begins.
#include "common/core/text.h"
#include "testbed/testbed_node.h"

namespace berth {

using namespace testbed;

namespace {

constexpr Utime planning_time = second;

bool is_motion(std::int8_t command) {
  return command >= testbed_command_t::MOVE && command <= testbed_command_t::STATION_KEEP;
}

/// Nothing when position and quaternion do not make a pose.
std::optional<Pose> pose_of(const double* position, const double* q_wxyz) {
  const Pose pose{Vector3d(position[0], position[1], position[2]),
                  Quaterniond(q_wxyz[0], q_wxyz[1], q_wxyz[2], q_wxyz[3])};
  const double norm = pose.rotation.norm();
  if (!pose.position.allFinite() || !(std::abs(norm - 1) < 1e-3)) return std::nullopt;
  return Pose{pose.position, pose.rotation.normalized()};
}

/// The same relative pose seen as a path that never comes to its end: what is steered, not planned.
class HeldPath final : public RelativePath {
 public:
  explicit HeldPath(const Pose& pose) : pose_(pose) {}
  double duration() const override { return 0; }
  Point at(double) const override { return {pose_, 0}; }

 private:
  Pose pose_;
};

}  // namespace

void TestbedNode::on_command(const testbed_command_t& command) {
  if (command.session != session()) {
    event(event_t::WARNING, "command-of-another-session",
          "a command of '" + command.commander + "' belongs to session " +
              std::to_string(command.session) + " and moves nothing");
    return;
  }
  if (now() > command.utime_expires) {
    event(event_t::WARNING, "command-expired",
          "a command of '" + command.commander + "' came " +
              fixed(seconds(now() - command.utime_expires), 1) + " s too late and moves nothing");
    return;
  }
  if (on_lease_command(command)) return;
  std::int64_t& last = last_seq_[command.commander];
  if (command.seq <= last) {
    publish_state(false);  // a repetition: tell him again
    return;
  }
  last = command.seq;
  begin(command);
  publish_state(true);
}

bool TestbedNode::on_lease_command(const testbed_command_t& command) {
  switch (command.command) {
    case testbed_command_t::TAKE_LEASE: {
      const bool had = lease_.held_by(command.commander, now());
      if (!lease_.take(command.commander, now())) {
        refuse(command, "the lease is held by '" + lease_.holder() + "'");
      } else if (!had) {
        event(event_t::INFO, "lease-taken", "'" + command.commander + "' commands the testbed");
      }
      break;
    }
    case testbed_command_t::KEEP_LEASE:
      lease_.keep(command.commander, now());
      return true;  // at 2 Hz: not worth a state message of its own
    case testbed_command_t::RELEASE_LEASE:
      if (lease_.release(command.commander, now())) {
        event(event_t::INFO, "lease-released", "nobody commands the testbed");
      }
      break;
    default:
      return false;
  }
  publish_state(true);
  return true;
}

void TestbedNode::accept(const testbed_command_t& command) { command_seq_ = command.seq; }

void TestbedNode::refuse(const testbed_command_t& command, const std::string& reason) {
  refused_seq_ = command.seq;
  refusal_ = reason;
  event(event_t::WARNING, "command-refused", reason);
}

void TestbedNode::begin(const testbed_command_t& command) {
  const std::int8_t what = command.command;
  if (what == testbed_command_t::HOLD) {
    accept(command);
    if (mode_ != Mode::idle && !held_) {
      held_ = true;
      hold_reason_ = "held by '" + command.commander + "'";
      event(event_t::NOTICE, "hold", hold_reason_);
    }
    return;
  }
  if (what == testbed_command_t::STOP) {
    accept(command);
    stopping_ = true;
    after_stop_ = command;
    if (mode_ == Mode::idle || mode_ == Mode::starting || !engaged_) end_task(false);
    return;
  }
  if (!lease_.held_by(command.commander, now())) {
    return refuse(command, lease_.held(now()) ? "the lease is held by '" + lease_.holder() + "'"
                                              : "nobody holds the lease: take it first");
  }
  std::string reason;
  if (is_motion(what)) {
    reason = begin_motion(command);
  } else if (what == testbed_command_t::RESUME) {
    reason = resume(command);
  } else if (what == testbed_command_t::RETREAT) {
    if (mode_ != Mode::idle && engaged_) {
      stopping_ = true;  // first to rest
      after_stop_ = command;
    } else {
      reason = retreat(command);
    }
  } else if (what == testbed_command_t::RESET) {
    stop_arms("reset", "reset by '" + command.commander + "'");
    order(arm_command_t::RESET);
    stopping_ = true;
    after_stop_ = command;
    end_task(false);
  } else {
    reason = "command " + std::to_string(what) + " is not known";
  }
  if (reason.empty()) {
    accept(command);
  } else {
    refuse(command, reason);
  }
}

std::string TestbedNode::resume(const testbed_command_t& command) {
  if (mode_ == Mode::idle) return "nothing is held";
  if (verdict_.level >= Level::held) return verdict_.reason;
  if (!engaged_ && mode_ != Mode::starting) {
    // The arms were stopped: started anew, they first go back to the path.
    mode_ = Mode::starting;
    start_begun_ = now();
    order_sent_ = 0;
    rejoining_ = false;
  }
  if (mode_ == Mode::starting) start_begun_ = now();
  if (command.speed_override > 0) override_ = std::min(command.speed_override, 1.0);
  held_ = false;
  hold_reason_.clear();
  guidance_.set_held(false);
  guidance_.set_override(override_);
  event(event_t::NOTICE, "resume", "resumed by '" + command.commander + "'");
  return "";
}

std::string TestbedNode::limits_of(const testbed_command_t& command, RelativeLimits& limits) const {
  limits = settings_.motion;
  if (command.speed_m_s != 0) limits.speed = command.speed_m_s;
  if (command.angular_speed_rad_s != 0) limits.angular_speed = command.angular_speed_rad_s;
  if (!(limits.speed > 0 && limits.speed <= settings_.greatest_speed)) {
    return "a speed of " + fixed(1e3 * limits.speed, 1) + " mm/s is not within 0 to " +
           fixed(1e3 * settings_.greatest_speed, 0) + " mm/s";
  }
  if (!(limits.angular_speed > 0 && limits.angular_speed <= settings_.greatest_angular_speed)) {
    return "an angular speed of " + fixed(degrees(limits.angular_speed), 1) +
           " deg/s is not within 0 to " + fixed(degrees(settings_.greatest_angular_speed), 0) +
           " deg/s";
  }
  return "";
}

std::string TestbedNode::begin_motion(const testbed_command_t& command) {
  if (mode_ != Mode::idle) {
    return "command " + std::to_string(task_.seq) + " is still being carried out: STOP it first";
  }
  if (verdict_.level != Level::good) return verdict_.reason;
  if (command.frozen_arm < 0 || command.frozen_arm > 2) {
    return "frozen_arm is " + std::to_string(command.frozen_arm) +
           ", expected 0 (none), 1 (replica) or 2 (sensor)";
  }
  // planning may take longer than a set-point lasts
  if (engaged_) stream(commanded_, planning_time);
  Task task;
  task.seq = command.seq;
  const bool closed_loop = command.command == testbed_command_t::APPROACH ||
                           command.command == testbed_command_t::STATION_KEEP;
  task.mode = closed_loop ? Mode::closed_loop : Mode::moving;
  override_ = command.speed_override > 0 ? std::min(command.speed_override, 1.0) : 1.0;
  std::string reason = closed_loop ? begin_closed_loop(command, task) : begin_move(command, task);
  if (reason.empty()) start_task(std::move(task));
  return reason;
}

std::string TestbedNode::begin_path(std::shared_ptr<const RelativePath> path,
                                    const testbed_command_t& command, Task& task) {
  const ArmPair start = reference_joints();
  const auto frozen = static_cast<FrozenArm>(command.frozen_arm);
  const MotionPlanner::Result result = planner_.plan(std::move(path), start, frozen);
  if (const auto* refusal = std::get_if<Refusal>(&result)) {
    if (refusal->passing_rate <= 0) return refusal->text;
    return refusal->text + "; it passes at " + fixed(100 * refusal->passing_rate, 1) +
           " % of the speed asked for" +
           (command.speed_m_s > 0
                ? ", " + fixed(1e3 * command.speed_m_s * refusal->passing_rate, 1) + " mm/s"
                : "");
  }
  const auto& plan = std::get<MotionPlanner::Plan>(result);
  task.motion = plan.motion;
  task.allocation = std::make_shared<const ArmAllocation>(cell_, plan.sharing, frozen, start);
  return "";
}

std::string TestbedNode::begin_move(const testbed_command_t& command, Task& task) {
  const Pose from = relative(reference_joints());
  if (command.command == testbed_command_t::MOVE) {
    const auto goal = pose_of(command.position_m, command.q_wxyz);
    if (!goal) return "the goal is not a pose";
    RelativeLimits limits;
    std::string wrong = limits_of(command, limits);
    if (!wrong.empty()) return wrong;
    return begin_path(std::make_shared<const StraightPath>(from, *goal, limits), command, task);
  }
  std::vector<WaypointPath::Waypoint> waypoints;
  for (const waypoint_t& waypoint : command.waypoints) {
    const auto pose = pose_of(waypoint.position_m, waypoint.q_wxyz);
    const std::string name = "waypoint " + std::to_string(waypoints.size() + 1);
    if (!pose) return name + " is not a pose";
    if (waypoints.empty() && waypoint.time_s > 0) waypoints.push_back({0, from});
    if (!(waypoint.time_s >= 0) ||
        (!waypoints.empty() && waypoint.time_s <= waypoints.back().time)) {
      return name + " is not later than the one before";
    }
    if (waypoints.empty()) {
      constexpr double near_m = 0.005;
      constexpr double near_rad = 0.01;
      if (distance(from, *pose) > near_m || angle_between(from, *pose) > near_rad) {
        return "the trajectory begins " + fixed(1e3 * distance(from, *pose), 0) + " mm and " +
               fixed(degrees(angle_between(from, *pose)), 1) +
               " deg away from where the arms are: move there first";
      }
      waypoints.push_back({0, from});
    } else {
      waypoints.push_back({waypoint.time_s, *pose});
    }
  }
  if (waypoints.size() < 2) return "a trajectory needs a waypoint with a time above 0";
  return begin_path(std::make_shared<const WaypointPath>(std::move(waypoints)), command, task);
}

std::string TestbedNode::begin_closed_loop(const testbed_command_t& command, Task& task) {
  const Pose commanded = relative(reference_joints());
  RelativeLimits limits;
  std::string wrong = limits_of(command, limits);
  if (!wrong.empty()) return wrong;
  std::shared_ptr<const RelativePath> path;
  if (command.command == testbed_command_t::APPROACH) {
    if (!(command.standoff_m > 0)) return "the standoff must be positive";
    // A place in front of the sensor is the docking interface's at the end.
    std::optional<Docking> docking;
    if (command.position_m[2] > 0) {
      if (!cell_.target.has_docking_interface) {
        return "target '" + cell_.target.name + "' names no docking interface";
      }
      docking = {cell_.target.docking.position, Vector3d::Map(command.position_m)};
    }
    if (const auto reason =
            guidance_.approach(now(), commanded, command.standoff_m, limits, docking)) {
      return *reason;
    }
    path = std::make_shared<const StraightPath>(commanded, guidance_.predicted_end(), limits);
  } else {
    const auto wanted = pose_of(command.position_m, command.q_wxyz);
    if (!wanted) return "the pose to keep is not a pose";
    if (const auto reason = guidance_.keep(now(), commanded, *wanted, limits)) return *reason;
    path = std::make_shared<const HeldPath>(commanded);
  }
  wrong = begin_path(std::move(path), command, task);
  if (!wrong.empty()) {
    guidance_.stop();
    return wrong;
  }
  guidance_.set_override(override_);
  event(event_t::INFO, "closed-loop",
        "the estimate stands " + fixed(1e3 * guidance_.initial_distance(), 1) + " mm and " +
            fixed(degrees(guidance_.initial_angle()), 2) + " deg from the commanded pose");
  return "";
}

std::string TestbedNode::retreat(const testbed_command_t& command) {
  if (verdict_.level != Level::good) return verdict_.reason;
  if (trail_.size() < 2) return "there is no way back: nothing has moved since the last retreat";
  RelativeLimits limits;
  testbed_command_t with_speed = command;
  if (with_speed.speed_m_s == 0) with_speed.speed_m_s = settings_.retreat_speed;
  std::string wrong = limits_of(with_speed, limits);
  if (!wrong.empty()) return wrong;

  std::vector<ArmPair> points(trail_.rbegin(), trail_.rend());
  std::vector<double> lengths(trail_lengths_.rbegin(), trail_lengths_.rend());
  const ArmPair start = reference_joints();
  if (largest_change(start, points.front()) > 1e-6) {
    lengths.insert(lengths.begin(), travel_between(start, points.front()));
    points.insert(points.begin(), start);
  }
  if (engaged_) stream(commanded_, planning_time);
  Task task;
  task.seq = command.seq;
  task.mode = Mode::moving;
  task.retreat = true;
  task.motion = std::make_shared<const RecordedMotion>(std::move(points), lengths, limits.speed,
                                                       limits.acceleration,
                                                       4 * limits.acceleration / limits.rise_time);
  if (const auto refusal = check_.check(*task.motion, start)) return refusal->text;
  override_ = command.speed_override > 0 ? std::min(command.speed_override, 1.0) : 1.0;
  start_task(std::move(task));
  return "";
}

void TestbedNode::start_task(Task task) {
  commanded_ = reference_joints();
  if (!task.retreat) {
    trail_ = {commanded_};
    trail_lengths_.clear();
  }
  task_ = std::move(task);
  held_ = stopping_ = false;
  after_stop_.reset();
  hold_reason_.clear();
  guidance_reason_.clear();
  scale_.stop();
  if (engaged_) {
    mode_ = task_.mode;
  } else {
    mode_ = Mode::starting;
    start_begun_ = now();
    order_sent_ = 0;
    rejoining_ = false;
  }
  event(event_t::INFO, "motion-begins", "command " + std::to_string(task_.seq));
}

}  // namespace berth
