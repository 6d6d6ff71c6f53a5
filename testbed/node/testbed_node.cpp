// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/node/testbed_node.h"

#include <berth/lidar_state_t.hpp>
#include <berth/node_status_t.hpp>
#include <berth/scan_request_t.hpp>

#include "common/core/text.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"

namespace berth {

using namespace testbed;

namespace {

constexpr Utime state_period = 100 * millisecond;
/// A late tick must not make the motion leap.
constexpr Utime max_tick = 50 * millisecond;

}  // namespace

TestbedNode::TestbedNode(NodeSetup setup, CalibratedCell cell, Settings settings, Bus& bus,
                         Loop& loop)
    : Node(std::move(setup), bus, loop),
      cell_(std::move(cell.cell)),
      relative_pose_(cell_),
      settings_(std::move(settings)),
      calibration_(std::move(cell.calibration)),
      target_(cell_.target.mesh),
      clearance_(cell_, settings_.clearance),
      check_(cell_, settings_.path, clearance_),
      planning_clearance_(cell_, settings_.clearance),
      planning_check_(cell_, settings_.path, planning_clearance_),
      planner_(cell_, planning_check_, planning_clearance_),
      commands_(cell_, settings_, planner_, target_),
      truth_(cell_, calibration_, settings_.truth,
             [this](const Truth& truth) { publish_truth(truth); }),
      guidance_(target_, settings_.guidance),
      safety_(settings_.safety),
      report_watch_{{"the replica arm", *cell_.replica.kinematics},
                    {"the sensor arm", *cell_.sensor.kinematics}},
      following_watch_{{ArmRole::replica, *cell_.replica.kinematics, settings_.following_watch},
                       {ArmRole::sensor, *cell_.sensor.kinematics, settings_.following_watch}},
      dead_time_(settings_.dead_time),
      estimate_watch_(settings_.estimate_watch),
      lease_(settings_.lease_lifetime),
      scale_(settings_.hold_settling),
      command_history_(settings_.following_watch.max_dead_time + second),
      last_tick_(loop.now()),
      trajectory_history_(cell_) {
  verdict_ = safety_.judge(now(), {});
  bus.subscribe<arm_state_t>(
      channels::arm_state_replica, Queue::fifo(),
      [this](const arm_state_t& state) { on_arm_state(ArmRole::replica, state); });
  bus.subscribe<arm_state_t>(
      channels::arm_state_sensor, Queue::fifo(),
      [this](const arm_state_t& state) { on_arm_state(ArmRole::sensor, state); });
  bus.subscribe<facility_state_t>(channels::facility_state, Queue::latest(),
                                  [this](const facility_state_t& state) { on_facility(state); });
  bus.subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(),
                             [this](const heartbeat_t& heartbeat) {
                               if (heartbeat.session != session()) return;
                               safety_.on_heartbeat(heartbeat.node, now());
                             });
  bus.subscribe<node_status_t>(
      channels::node_status, Queue::fifo(), [this](const node_status_t& status) {
        if (status.session != session()) return;
        const bool fault = status.state == node_status_t::FAULT;
        safety_.on_node(status.node, fault ? status.node + " is in FAULT: " + status.reason : "");
      });
  bus.subscribe<pose_estimate_t>(channels::pose_estimate, Queue::latest(),
                                 [this](const pose_estimate_t& message) { on_estimate(message); });
  bus.subscribe<lidar_state_t>(
      channels::lidar_state, Queue::latest(), [this](const lidar_state_t& state) {
        const bool lost =
            state.state == lidar_state_t::OFFLINE || state.state == lidar_state_t::FAULT;
        const std::string why = state.reason.empty() ? "the LIDAR is lost" : state.reason;
        if (state.session == session()) safety_.on_lidar(lost ? why : "");
      });
  bus.subscribe<scan_request_t>(channels::scan_request, Queue::fifo(),
                                [this](const scan_request_t& request) {
                                  if (request.session != session()) return;
                                  safety_.on_scan(now(), request.action != scan_request_t::CANCEL);
                                });
  bus.subscribe<ScanPacket>(channels::scan_data, Queue::fifo(), [this](const ScanPacket& packet) {
    if (packet.session != session()) return;
    safety_.on_scan(now(), packet.scan_status == ScanPacket::RUNNING);
  });
  bus.subscribe<guidance_setpoint_t>(
      channels::guidance_setpoint, Queue::fifo(),
      [this](const guidance_setpoint_t& setpoint) { on_setpoint(setpoint); });
  bus.subscribe<testbed_command2_t>(
      channels::testbed_command, Queue::fifo(100),
      [this](const testbed_command2_t& command) { on_command(command); });
  tick_timer_ = loop.every(settings_.setpoint_period, [this] { tick(); });
  state_timer_ = loop.every(state_period, [this] { publish_state(false); });
  latency_timer_ = loop.every(10 * second, [this] {
    if (latency_.seq > 0) publish_latency();  // for nodes that join later
  });
  report(node_status_t::STARTING, verdict_.reason);
  for (const std::string& note : target_notes(cell_.target)) {
    event(event_t::WARNING, "target", "target '" + cell_.target.name + "': " + note);
  }
}

TestbedNode::~TestbedNode() {
  end_work();
  loop().cancel(tick_timer_);
  loop().cancel(state_timer_);
  loop().cancel(latency_timer_);
}

// ---- the set-point clock ----

ArmPair TestbedNode::reference_joints() const { return engaged_ ? commanded_ : reported_; }

Pose TestbedNode::relative(const ArmPair& joints) {
  return relative_pose_.at(joints.replica, joints.sensor);
}

void TestbedNode::tick() {
  const Utime t = now();
  const double dt = seconds(std::min(t - last_tick_, max_tick));
  last_tick_ = t;
  if (lease_.lapse(t)) {
    event(event_t::WARNING, "lease-lapsed", "the commander is silent");
    if (mode_ != Mode::idle && !held_) {
      held_ = true;
      hold_reason_ = "the commander is silent";
    }
  }
  supervise();
  resume_when_good();
  repeat_hold_until_at_rest();
  watch_clearance();
  watch_rest();
  const Pose before = relative(commanded_);
  const bool wait = verdict_.level != Level::good;
  switch (mode_) {
    case Mode::idle:
      if (engaged_ && !lease_.held(t)) {
        // no commander: the controllers hold the arms by themselves
        order(arm_command_t::HOLD);
        engaged_ = false;
      }
      if (engaged_) stream(commanded_, settings_.setpoint_lifetime);
      break;
    case Mode::starting:
      run_start(dt);
      break;
    case Mode::moving:
      if (engaged_) run_motion(dt, wait);
      break;
    case Mode::closed_loop:
      if (engaged_) run_closed_loop(dt);
      break;
  }
  if (!engaged_ && mode_ == Mode::idle) commanded_ = reported_;
  const bool notes_itself = mode_ == Mode::closed_loop && engaged_ && !task_.steering;
  if (!notes_itself) guidance_.note_commanded(t, relative(commanded_));
  commanded_velocity_ = dt > 0 && engaged_ && mode_ != Mode::idle
                            ? velocity_between(before, relative(commanded_), dt)
                            : Velocity{};
  publish_state(true);
}

void TestbedNode::run_motion(double dt, bool wait) {
  scale_.set_target(held_ || stopping_ || wait ? 0 : rate());
  task_.time = std::min(task_.time + scale_.advance(dt), task_.motion->duration());
  std::string reason;
  const auto joints = task_.motion->at(task_.time, commanded_, &reason);
  if (!joints) return stop_arms("motion-failed", reason);
  stream(*joints, settings_.setpoint_lifetime);
  if (!task_.retreat) trajectory_history_.add(*joints);
  if (stopping_ && scale_.at_rest() && !waits_to_retreat()) return end_task(false);
  if (task_.time >= task_.motion->duration()) end_task(!stopping_);
}

bool TestbedNode::waits_to_retreat() const {
  return held_ && after_stop_ && after_stop_->command == testbed_command2_t::RETREAT;
}

/// finished: carried out to its end; otherwise given up on request.
void TestbedNode::end_task(bool finished) {
  if (mode_ == Mode::starting) {
    order(arm_command_t::HOLD);
    engaged_ = false;
  }
  if (mode_ != Mode::idle) {
    if (task_.mode == Mode::closed_loop) {
      if (!task_.steering) guidance_.note_target_moved(target_at(task_.target_motion, task_.time));
      publish_guidance({});
    }
    if (!abort_reason_.empty()) {
      refused_seq_ = task_.seq;
      refusal_ = abort_reason_;
    }
    if (finished) finished_seq_ = task_.seq;
    event(event_t::INFO, finished ? "motion-finished" : "motion-abandoned",
          "command " + std::to_string(task_.seq));
    if (task_.retreat && finished) trajectory_history_.clear();
  }
  mode_ = Mode::idle;
  task_ = {};
  held_ = stopping_ = rejoining_ = paused_ = false;
  hold_reason_.clear();
  guidance_reason_.clear();
  abort_reason_.clear();
  scale_.stop();
  guidance_.stop();
  if (!after_stop_) return;
  const testbed_command2_t next = *after_stop_;
  after_stop_.reset();
  if (next.command != testbed_command2_t::RETREAT) {
    finished_seq_ = next.seq;
    return;
  }
  const std::string reason = retreat(next);
  if (!reason.empty()) refuse(next, reason);
}

void TestbedNode::stream(const ArmPair& joints, Utime lifetime) {
  if (mode_ != Mode::starting) commanded_ = joints;
  command_history_.add(now(), joints);
  for (const ArmRole role : both_arms) {
    send(role, arm_command_t::STREAM, joints.of(role), lifetime);
  }
}

void TestbedNode::order(std::int8_t action) {
  if (action == arm_command_t::HOLD) hold_ordered_ = now();
  for (const ArmRole role : both_arms) {
    send(role, action, reported_.of(role), settings_.setpoint_lifetime);
  }
}

/// Repeats the HOLD with its number: a driver obeys it once.
void TestbedNode::repeat_hold(ArmRole role) {
  bus().publish(
      role == ArmRole::replica ? channels::arm_command_replica : channels::arm_command_sensor,
      last_hold_[role == ArmRole::replica ? 0 : 1]);
}

void TestbedNode::send(ArmRole role, std::int8_t action, const Joints& joints, Utime lifetime) {
  arm_command_t command{};
  command.utime = now() + (action == arm_command_t::STREAM ? settings_.dead_time : 0);
  command.seq = ++arm_command_seq_[role == ArmRole::replica ? 0 : 1];
  command.session = session();
  command.utime_expires = now() + lifetime;
  command.action = action;
  std::copy(joints.begin(), joints.end(), command.joint);
  command.speed_limit = 1;
  if (action == arm_command_t::HOLD) last_hold_[role == ArmRole::replica ? 0 : 1] = command;
  bus().publish(
      role == ArmRole::replica ? channels::arm_command_replica : channels::arm_command_sensor,
      command);
}

std::unique_ptr<Node> make_testbed_node(NodeSetup setup, const RunSetup& run, Bus& bus,
                                        Loop& loop) {
  CalibratedCell cell = load_calibrated_cell(run);
  Settings settings = load_settings(run.config / "testbed.yaml", cell.cell);
  return std::make_unique<TestbedNode>(std::move(setup), std::move(cell), std::move(settings), bus,
                                       loop);
}

}  // namespace berth
