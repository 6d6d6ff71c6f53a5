// SPDX-License-Identifier: BSD-3-Clause
// TESTBED_COMMAND: which commander may request what, and how a motion begins.
#include <algorithm>

#include "common/core/text.h"
#include "testbed/node/testbed_node.h"

namespace berth {

using namespace testbed;

/// HOLD and STOP of any commander. A repetition of an obeyed one is acknowledged only.
void TestbedNode::on_stop(const testbed_command2_t& command) {
  if (!seen_.add(command)) return publish_state(false);
  const bool own = command.session == session();
  std::int64_t& last = last_seq_[command.commander];
  const std::string unusual = unusual_stop(command, session(), now(), own && command.seq <= last);
  if (!unusual.empty()) {
    event(event_t::WARNING, "unusual-stop",
          std::string(command.command == testbed_command2_t::HOLD ? "HOLD" : "STOP") + " of '" +
              command.commander + "' is obeyed, although it " + unusual);
  }
  if (own) last = std::max(last, command.seq);
  begin(command);
  publish_state(true);
}

void TestbedNode::on_command(const testbed_command2_t& command) {
  const std::int8_t what = command.command;
  if (what == testbed_command2_t::HOLD || what == testbed_command2_t::STOP) return on_stop(command);
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
  if (!seen_.add(command)) return publish_state(false);  // a repetition: answered again
  std::int64_t& last = last_seq_[command.commander];
  if (command.seq <= last) {
    refuse(command, "command " + std::to_string(command.seq) + " comes behind command " +
                        std::to_string(last) + " of the same commander: send it anew");
    return publish_state(true);
  }
  last = command.seq;
  begin(command);
  publish_state(true);
}

bool TestbedNode::on_lease_command(const testbed_command2_t& command) {
  switch (command.command) {
    case testbed_command2_t::TAKE_LEASE: {
      const bool had = lease_.held_by(command.commander, now());
      if (!lease_.take(command.commander, now())) {
        refuse(command, "the lease is held by '" + lease_.holder() + "'");
      } else if (!had) {
        event(event_t::INFO, "lease-taken", "'" + command.commander + "' commands the testbed");
      }
      break;
    }
    case testbed_command2_t::KEEP_LEASE:
      if (lease_.keep(command.commander, now())) set_override(command.speed_override);
      publish_state(true);
      return true;
    case testbed_command2_t::RELEASE_LEASE:
      if (lease_.release(command.commander, now())) {
        event(event_t::INFO, "lease-released", "no commander holds the lease");
      }
      break;
    default:
      return false;
  }
  publish_state(true);
  return true;
}

/// Another session's numbers are not ours to acknowledge.
void TestbedNode::accept(const testbed_command2_t& command) {
  if (command.session == session()) command_seq_ = command.seq;
}

void TestbedNode::refuse(const testbed_command2_t& command, const std::string& reason) {
  refused_seq_ = command.seq;
  refusal_ = reason;
  event(event_t::WARNING, "command-refused", reason);
}

void TestbedNode::begin(const testbed_command2_t& command) {
  const std::int8_t what = command.command;
  if (what == testbed_command2_t::HOLD) {
    accept(command);
    const std::string reason = "held by '" + command.commander + "'";
    if (planning_) {
      planning_->hold_reason = reason;
      event(event_t::NOTICE, "hold", reason);
    } else if (mode_ != Mode::idle && !held_) {
      held_ = true;
      hold_reason_ = reason;
      event(event_t::NOTICE, "hold", reason);
    }
    return;
  }
  if (what == testbed_command2_t::STOP) {
    accept(command);
    abandon_planning("stopped by '" + command.commander + "' while its motion was planned");
    stopping_ = true;
    after_stop_.reset();
    if (command.session == session()) after_stop_ = command;
    if (mode_ == Mode::idle || mode_ == Mode::starting || !engaged_) end_task(false);
    return;
  }
  if (!lease_.held_by(command.commander, now())) {
    return refuse(command, lease_.held(now()) ? "the lease is held by '" + lease_.holder() + "'"
                                              : "no commander holds the lease: take it first");
  }
  std::string reason;
  if (is_motion(command)) {
    reason = begin_motion(command);
    if (reason.empty()) return;  // answered when it is planned
  } else if (what == testbed_command2_t::RESUME) {
    reason = resume(command);
  } else if (what == testbed_command2_t::RETREAT) {
    if (mode_ != Mode::idle && engaged_) {
      stopping_ = true;  // first to rest
      held_ = false;
      after_stop_ = command;
    } else {
      reason = retreat(command);
      if (reason.empty()) return;
    }
  } else if (what == testbed_command2_t::RESET) {
    reason = safety_.unresettable_fault();
    if (reason.empty()) reset("reset by '" + command.commander + "'");
  } else {
    reason = "command " + std::to_string(what) + " is not known";
  }
  if (reason.empty()) {
    accept(command);
  } else {
    refuse(command, reason);
  }
}

/// The controllers' alarms. A motion stays where it was left, for RESUME or STOP.
void TestbedNode::reset(const std::string& reason) {
  abandon_planning(reason + " while its motion was planned");
  event(event_t::NOTICE, "reset", reason);
  stop_arms("", reason);
  order(arm_command_t::RESET);
}

std::string TestbedNode::resume(const testbed_command2_t& command) {
  if (mode_ == Mode::idle) return "nothing is held";
  if (verdict_.level >= Level::held) return verdict_.reason;
  if (task_.mode == Mode::closed_loop && estimate_watch_.contradiction()) {
    return estimate_watch_.contradiction()->text;
  }
  if (!engaged_ && mode_ != Mode::starting) {
    // The arms were stopped: started anew, they first go back to the path.
    begin_start();
  }
  if (mode_ == Mode::starting) start_begun_ = now();
  set_override(command.speed_override);
  held_ = false;
  hold_reason_.clear();
  guidance_.set_held(false);
  event(event_t::NOTICE, "resume", "resumed by '" + command.commander + "'");
  return "";
}

/// Applies to the motion under way and to a resumed one: the speed changes smoothly, on the same
/// path. 0: unchanged.
void TestbedNode::set_override(double override) {
  if (!(override > 0)) return;
  override_ = std::min(override, 1.0);
  guidance_.set_override(rate());
}

double TestbedNode::rate() const {
  return std::min({override_, controller_override_[0], controller_override_[1]});
}

/// reported: 0..1; 0: the driver knows none.
void TestbedNode::on_controller_override(ArmRole role, double reported) {
  const double given = reported > 0 ? std::min(reported, 1.0) : 1;
  double& known = controller_override_[role == ArmRole::replica ? 0 : 1];
  if (given == known) return;
  known = given;
  guidance_.set_override(rate());
  event(event_t::NOTICE, "controller-override",
        std::string("the ") + name_of(role) + " arm's controller runs at " + fixed(100 * given, 0) +
            " % of its speed: motions go at " + fixed(100 * rate(), 0) + " %");
}

std::string TestbedNode::begin_motion(const testbed_command2_t& command) {
  if (planning_) {
    return "command " + std::to_string(planning_->command.seq) +
           " is still being planned: STOP it first";
  }
  if (mode_ != Mode::idle) {
    return "command " + std::to_string(task_.seq) + " is still being carried out: STOP it first";
  }
  if (verdict_.level != Level::good) return verdict_.reason;
  if (is_closed_loop(command) && estimate_watch_.contradiction()) {
    return estimate_watch_.contradiction()->text;
  }
  set_override(command.speed_override > 0 ? command.speed_override : 1.0);
  const ArmPair start = reference_joints();
  return plan(command, start, [=, this, time = now(), guidance = guidance_](Planned& planned) {
    auto result = commands_.plan(command, start, time, guidance);
    if (auto* refusal = std::get_if<std::string>(&result)) {
      planned.refusal = std::move(*refusal);
      return;
    }
    auto& plan = std::get<CommandPlanner::Plan>(result);
    if (guidance.estimate()) planned.utime_estimate = guidance.estimate()->utime;
    planned.guidance = std::move(plan.guidance);
    planned.task.mode = is_closed_loop(command) ? Mode::closed_loop : Mode::moving;
    planned.task.motion = plan.arms.motion;
    planned.task.steering = plan.steering;
    planned.task.target_motion = plan.target_motion;
    planned.task.allocation = std::make_shared<const ArmAllocation>(
        cell_, plan.arms.resolution, static_cast<FrozenArm>(command.frozen_arm), start);
  });
}

std::string TestbedNode::retreat(const testbed_command2_t& command) {
  if (verdict_.level != Level::good) return verdict_.reason;
  const ArmPair start = reference_joints();
  return plan(command, start, [=, this, history = trajectory_history_](Planned& planned) {
    auto way_back = commands_.way_back(command, history, planning_check_, start);
    if (auto* wrong = std::get_if<std::string>(&way_back)) {
      planned.refusal = std::move(*wrong);
      return;
    }
    planned.task.mode = Mode::moving;
    planned.task.retreat = true;
    planned.task.motion = std::get<std::shared_ptr<const ArmMotion>>(std::move(way_back));
  });
}

/// @return the refusal; empty when planning has begun, after which the command is answered.
std::string TestbedNode::plan(const testbed_command2_t& command, const ArmPair& start,
                              std::function<void(Planned&)> job) {
  planning_ = Planning{command, start, ""};
  const auto planned = std::make_shared<Planned>();
  const bool given =
      work({"planning command " + std::to_string(command.seq), settings_.planning_budget,
            [job = std::move(job), planned] { job(*planned); },
            [this, seq = command.seq, planned] {
              if (!planning_ || planning_->command.seq != seq) return;  // given up
              const Planning planning = std::move(*planning_);
              planning_.reset();
              begin_planned(planning, std::move(*planned));
            }});
  if (given) return "";
  planning_.reset();
  return "too many motions wait to be planned";
}

void TestbedNode::abandon_planning(const std::string& reason) {
  if (!planning_) return;
  refuse(planning_->command, reason);
  planning_.reset();
}

/// Why a planned motion may not begin any more; empty: it may.
std::string TestbedNode::refusal_after_planning(const Planning& planning, const Task& task) const {
  if (!task.retreat && !lease_.held_by(planning.command.commander, now())) {
    return "the lease was lost while the motion was planned";
  }
  if (verdict_.level != Level::good) return verdict_.reason;
  if (task.mode == Mode::closed_loop && estimate_watch_.contradiction()) {
    return estimate_watch_.contradiction()->text;
  }
  if (max_change(planning.start, reference_joints()) > rest_angle) {
    return "the arms have moved while their motion was planned";
  }
  return "";
}

void TestbedNode::begin_planned(const Planning& planning, Planned planned) {
  const testbed_command2_t& command = planning.command;
  Task& task = planned.task;
  std::string reason = planned.refusal;
  if (reason.empty()) reason = refusal_after_planning(planning, task);
  if (!reason.empty()) return refuse(command, reason);
  task.seq = command.seq;
  if (planned.guidance) guidance_.continue_as(std::move(*planned.guidance));
  if (task.retreat) set_override(command.speed_override > 0 ? command.speed_override : 1.0);
  if (task.mode == Mode::closed_loop && task.steering) {
    const auto& estimate = guidance_.estimate();
    if (estimate && estimate->utime > planned.utime_estimate) task.steering->on_estimate(*estimate);
    const GuidanceReport report = task.steering->report();
    event(event_t::INFO, "closed-loop",
          "law " + report.law + ", " + report.profile + "; 1 m of the cell is " +
              shown(report.length_scale) + " m of orbit, 1 s is " + shown(report.time_scale) +
              " s; forecast " + fixed(task.steering->remaining(), 0) + " s");
  } else if (task.mode == Mode::closed_loop) {
    event(event_t::INFO, "closed-loop",
          "the estimate is " + fixed(1e3 * guidance_.initial_distance(), 1) + " mm and " +
              fixed(degrees(guidance_.initial_angle()), 2) + " deg from the commanded pose");
  }
  start_task(std::move(task), planning.start);
  held_ = !planning.hold_reason.empty();
  hold_reason_ = planning.hold_reason;
  accept(command);
}

void TestbedNode::start_task(Task task, const ArmPair& start) {
  commanded_ = start;
  if (!task.retreat) trajectory_history_.begin(commanded_);
  task_ = std::move(task);
  held_ = stopping_ = paused_ = false;
  after_stop_.reset();
  hold_reason_.clear();
  guidance_reason_.clear();
  scale_.stop();
  if (engaged_) {
    mode_ = task_.mode;
  } else {
    begin_start();
  }
  event(event_t::INFO, "motion-begins", "command " + std::to_string(task_.seq));
}

}  // namespace berth
