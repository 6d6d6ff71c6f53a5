// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/testbed_node.h"

#include <berth/ground_truth_t.hpp>

#include "common/core/sha256.h"
#include "common/core/text.h"
#include "lcmtypes/channels.h"

namespace berth {

using namespace testbed;

namespace {

constexpr Utime state_period = 100 * millisecond;
/// A late tick must not make the motion leap.
constexpr Utime longest_tick = 50 * millisecond;
constexpr Utime order_period = 250 * millisecond;
constexpr Utime instant_check_period = 200 * millisecond;
constexpr Utime history_length = 2 * second;
/// How long set-points have to flow before the arms are expected to follow.
constexpr Utime following_delay = second;
/// Spacing of the trail that a retreat goes back on, in m of relative travel.
constexpr double trail_spacing = 0.01;
/// m of relative travel that a radian counts for on the trail.
constexpr double lever = 1.5;
constexpr int clearance_every = 5;  // states

void set_pose(const Pose& pose, double* position, double* q_wxyz) {
  for (int i = 0; i < 3; ++i) position[i] = pose.position[i];
  q_wxyz[0] = pose.rotation.w();
  q_wxyz[1] = pose.rotation.x();
  q_wxyz[2] = pose.rotation.y();
  q_wxyz[3] = pose.rotation.z();
}

SafetySupervisor::ArmState arm_state_of(std::int8_t state) {
  using State = SafetySupervisor::ArmState;
  switch (state) {
    case arm_state_t::IDLE:
      return State::idle;
    case arm_state_t::RUNNING:
      return State::running;
    case arm_state_t::HELD:
      return State::held;
    case arm_state_t::FAULT:
      return State::fault;
    case arm_state_t::ESTOP:
      return State::estop;
    default:
      return State::offline;
  }
}

std::string status_name(std::int8_t status) {
  switch (status) {
    case pose_estimate_t::ACQUIRING:
      return "still being acquired";
    case pose_estimate_t::OK:
      return "good";
    case pose_estimate_t::AMBIGUOUS:
      return "ambiguous";
    case pose_estimate_t::LOST:
      return "lost";
    default:
      return "idle";
  }
}

}  // namespace

TestbedNode::TestbedNode(NodeSetup setup, Cell cell, Settings settings,
                         std::string calibration_hash, Bus& bus, Loop& loop)
    : Node(std::move(setup), bus, loop),
      cell_(std::move(cell)),
      settings_(std::move(settings)),
      calibration_hash_(std::move(calibration_hash)),
      target_(cell_.target.mesh),
      clearance_(cell_, settings_.clearance),
      check_(cell_, settings_.path, clearance_),
      planner_(cell_, check_),
      commands_(cell_, settings_, planner_),
      truth_(cell_, settings_.truth, [this](const Truth& truth) { publish_truth(truth); }),
      guidance_(target_, settings_.guidance),
      safety_(settings_.safety),
      lease_(settings_.lease_lifetime),
      scale_(settings_.hold_settling),
      last_tick_(loop.now()) {
  verdict_ = safety_.judge(now(), false);
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
  bus.subscribe<pose_estimate_t>(channels::pose_estimate, Queue::latest(),
                                 [this](const pose_estimate_t& message) { on_estimate(message); });
  bus.subscribe<testbed_command_t>(
      channels::testbed_command, Queue::fifo(100),
      [this](const testbed_command_t& command) { on_command(command); });
  tick_timer_ = loop.every(settings_.setpoint_period, [this] { tick(); });
  state_timer_ = loop.every(state_period, [this] { publish_state(false); });
  report(node_status_t::STARTING, verdict_.reason);
}

TestbedNode::~TestbedNode() {
  loop().cancel(tick_timer_);
  loop().cancel(state_timer_);
}

// ---- what is heard ----

void TestbedNode::on_arm_state(ArmRole role, const arm_state_t& state) {
  if (state.session != session()) return;
  safety_.on_arm(role, {now(), state.valid != 0, arm_state_of(state.state), state.reason});
  reported_valid_[role == ArmRole::replica ? 0 : 1] = state.valid != 0;
  if (state.valid == 0) return;
  JointSample sample;
  sample.utime = state.utime;
  for (std::size_t i = 0; i < 6; ++i) {
    sample.joints[i] = state.reported_joint[i];
    sample.sigma[i] = state.reported_joint_sigma[i];
  }
  reported_.of(role) = sample.joints;
  truth_.add(role, sample);

  if (!engaged_ || now() - engaged_since_ < following_delay) return;
  const Utime commanded_at = state.utime - settings_.dead_time;
  const auto after =
      std::lower_bound(command_history_.begin(), command_history_.end(), commanded_at,
                       [](const auto& entry, Utime t) { return entry.first < t; });
  if (after == command_history_.end()) return;
  ArmPair commanded = after->second;
  if (after != command_history_.begin()) {
    const auto before = std::prev(after);
    const double s = static_cast<double>(commanded_at - before->first) /
                     static_cast<double>(after->first - before->first);
    commanded = blend(before->second, after->second, s);
  }
  const std::string strays =
      safety_.lag(role, *cell_.arm(role).kinematics, sample.joints, commanded.of(role));
  if (!strays.empty()) stop_arms("arm-strays", strays);
}

void TestbedNode::on_facility(const facility_state_t& state) {
  if (state.session != session()) return;
  safety_.on_facility(now(), state.valid, state.estop_chain_closed, state.fence_closed,
                      state.motion_enabled, state.reason);
}

void TestbedNode::on_estimate(const pose_estimate_t& message) {
  if (message.session != session()) return;
  Estimate estimate;
  estimate.utime = message.utime;
  estimate.usable = message.status == pose_estimate_t::OK;
  estimate.status = status_name(message.status);
  if (!estimate.usable && !message.reason.empty()) estimate.status += " (" + message.reason + ")";
  estimate.pose = {
      Vector3d(message.position_m[0], message.position_m[1], message.position_m[2]),
      Quaterniond(message.q_wxyz[0], message.q_wxyz[1], message.q_wxyz[2], message.q_wxyz[3])};
  if (estimate.usable &&
      !(estimate.pose.position.allFinite() && std::abs(estimate.pose.rotation.norm() - 1) < 1e-3)) {
    estimate.usable = false;
    estimate.status = "not a pose";
  }
  // An attitude that may be anything leads nowhere: only the position is steered by.
  double variance = 0;
  for (int i = 3; i < 6; ++i) variance = std::max(variance, message.covariance[7 * i]);
  estimate.attitude_known =
      std::sqrt(variance) < 0.5 * settings_.guidance.largest_angular_correction;
  guidance_.on_estimate(estimate);
}

// ---- the set-point clock ----

ArmPair TestbedNode::reference_joints() const { return engaged_ ? commanded_ : reported_; }

Pose TestbedNode::relative(const ArmPair& joints) const {
  return cell_.relative_pose(joints.replica, joints.sensor);
}

void TestbedNode::tick() {
  const Utime t = now();
  const double dt = seconds(std::min(t - last_tick_, longest_tick));
  last_tick_ = t;
  if (lease_.lapse(t)) {
    event(event_t::WARNING, "lease-lapsed", "the commander is silent");
    if (mode_ != Mode::idle && !held_) {
      held_ = true;
      hold_reason_ = "the commander is silent";
    }
  }
  supervise(safety_.judge(t, engaged_));
  const Pose before = relative(commanded_);
  const bool wait = verdict_.level != Level::good;
  switch (mode_) {
    case Mode::idle:
      if (engaged_ && !lease_.held(t)) {
        // nobody is going to move them: let the controllers stand by themselves
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
  if (mode_ != Mode::closed_loop || !engaged_) guidance_.note_commanded(t, relative(commanded_));
  commanded_velocity_ = dt > 0 && engaged_ && mode_ != Mode::idle
                            ? velocity_between(before, relative(commanded_), dt)
                            : Velocity{};
  publish_state(true);
}

void TestbedNode::supervise(const Verdict& verdict) {
  const bool changed = verdict.level != verdict_.level || verdict.code != verdict_.code;
  if (changed && verdict.level >= Level::hold) {
    const bool serious = verdict.level >= Level::held;
    if (!serious || engaged_ || mode_ == Mode::idle) {
      event(serious ? event_t::ERROR : event_t::WARNING, verdict.code, verdict.reason);
    }
  }
  if (changed && verdict.level == Level::good && verdict_.level >= Level::hold) {
    event(event_t::NOTICE, "good-again", "the cell is as it should be again");
  }
  verdict_ = verdict;
  if (verdict_.level >= Level::held && (engaged_ || mode_ == Mode::starting)) {
    stop_arms("", verdict_.reason);
  }
}

/// Both controllers stop by themselves, at once.
void TestbedNode::stop_arms(const std::string& code, const std::string& reason) {
  order(arm_command_t::HOLD);
  engaged_ = false;
  rejoining_ = false;
  scale_.stop();
  guidance_.set_held(true);
  if (!code.empty()) event(event_t::ERROR, code, reason);
  if (mode_ == Mode::idle) return;
  held_ = true;
  hold_reason_ = reason;
  mode_ = task_.mode;
  if (stopping_) end_task(false);
}

void TestbedNode::run_start(double dt) {
  const Utime t = now();
  if (stopping_) return end_task(false);
  if (held_ && !rejoining_) return;
  if (!rejoining_) {
    bool running = true;
    for (const ArmRole role : both_arms) {
      const auto& arm = safety_.arm(role);
      running = running && arm && arm->state == SafetySupervisor::ArmState::running;
    }
    if (!running || order_sent_ == 0 || t - order_sent_ < order_period / 2) {
      if (t - start_begun_ > settings_.start_time_limit) {
        stop_arms("start-failed", "the arms' controllers did not start");
      } else if (order_sent_ == 0 || (!running && t - order_sent_ >= order_period)) {
        order(arm_command_t::START);
        order_sent_ = t;
      }
      return;
    }
    rejoining_ = true;
    rejoin_from_ = reported_;
    rejoin_time_ = 0;
    const double away = largest_change(rejoin_from_, commanded_);
    rejoin_ = SmoothTravel(away, settings_.rejoin_speed, settings_.rejoin_speed,
                           4 * settings_.rejoin_speed);
    engaged_ = true;
    engaged_since_ = t;
    command_history_.clear();
  }
  rejoin_time_ += dt;
  const double s = rejoin_.length() > 0 ? rejoin_.position(rejoin_time_) / rejoin_.length() : 1.0;
  stream(blend(rejoin_from_, commanded_, s), settings_.setpoint_lifetime);
  if (rejoin_time_ < rejoin_.duration()) return;
  rejoining_ = false;
  mode_ = task_.mode;
  guidance_.set_held(held_);
}

void TestbedNode::run_motion(double dt, bool wait) {
  scale_.set_target(held_ || stopping_ || wait ? 0 : override_);
  task_.time = std::min(task_.time + scale_.advance(dt), task_.motion->duration());
  std::string reason;
  const auto joints = task_.motion->at(task_.time, commanded_, &reason);
  if (!joints) return stop_arms("motion-failed", reason);
  stream(*joints, settings_.setpoint_lifetime);
  remember(*joints);
  if (stopping_ && scale_.at_rest()) return end_task(false);
  if (task_.time >= task_.motion->duration()) end_task(!stopping_);
}

void TestbedNode::run_closed_loop(double dt) {
  guidance_.set_held(held_ || stopping_ || verdict_.level != Level::good);
  const Guidance::Output output = guidance_.step(now(), dt);
  std::string reason;
  const auto joints =
      task_.allocation->joints(output.commanded, output.progress, commanded_, &reason);
  if (!joints) return stop_arms("motion-failed", reason);
  if (largest_change(*joints, commanded_) > settings_.path.largest_step) {
    return stop_arms("motion-failed", "an arm would have to change its configuration");
  }
  // Where the estimate leads was not known when the path was checked.
  if (now() >= next_instant_check_) {
    next_instant_check_ = now() + instant_check_period;
    if (const auto wrong = check_.check(*joints)) return stop_arms("motion-failed", *wrong);
  }
  stream(*joints, settings_.setpoint_lifetime);
  remember(*joints);
  if (stopping_) {
    if (guidance_.at_rest()) end_task(false);
    return;
  }
  const std::string before = guidance_reason_;
  guidance_reason_ = output.phase == Guidance::Phase::holding ? output.reason : "";
  if (before.empty() != guidance_reason_.empty()) {
    if (guidance_reason_.empty()) {
      event(event_t::NOTICE, "goes-on", "the estimate is good again");
    } else {
      event(event_t::WARNING, "holding", guidance_reason_);
    }
  }
  if (output.phase == Guidance::Phase::gave_up && !held_) {
    held_ = true;
    hold_reason_ = output.reason;
    event(event_t::ERROR, "gave-up", output.reason);
  }
  if (output.phase == Guidance::Phase::done) {
    if (!output.reason.empty()) event(event_t::WARNING, "not-settled", output.reason);
    end_task(true);
  }
}

/// finished: carried out to its end; otherwise given up on request.
void TestbedNode::end_task(bool finished) {
  if (mode_ == Mode::starting) {
    order(arm_command_t::HOLD);
    engaged_ = false;
  }
  if (mode_ != Mode::idle) {
    if (finished) finished_seq_ = task_.seq;
    event(event_t::INFO, finished ? "motion-finished" : "motion-abandoned",
          "command " + std::to_string(task_.seq));
    if (task_.retreat && finished) {
      trail_.clear();
      trail_lengths_.clear();
    }
  }
  mode_ = Mode::idle;
  task_ = {};
  held_ = stopping_ = rejoining_ = false;
  hold_reason_.clear();
  guidance_reason_.clear();
  scale_.stop();
  guidance_.stop();
  if (!after_stop_) return;
  const testbed_command_t next = *after_stop_;
  after_stop_.reset();
  if (next.command != testbed_command_t::RETREAT) {
    finished_seq_ = next.seq;
    return;
  }
  const std::string reason = retreat(next);
  if (!reason.empty()) refuse(next, reason);
}

double TestbedNode::travel_between(const ArmPair& a, const ArmPair& b) const {
  const Pose from = relative(a);
  const Pose to = relative(b);
  return std::max({distance(from, to), lever * angle_between(from, to), 1e-6});
}

void TestbedNode::remember(const ArmPair& joints) {
  if (task_.retreat) return;
  const double length = travel_between(trail_.back(), joints);
  if (length < trail_spacing) return;
  trail_.push_back(joints);
  trail_lengths_.push_back(length);
}

void TestbedNode::stream(const ArmPair& joints, Utime lifetime) {
  if (mode_ != Mode::starting) commanded_ = joints;
  command_history_.emplace_back(now(), joints);
  while (command_history_.front().first < now() - history_length) command_history_.pop_front();
  for (const ArmRole role : both_arms) {
    send(role, arm_command_t::STREAM, joints.of(role), lifetime);
  }
}

void TestbedNode::order(std::int8_t action) {
  for (const ArmRole role : both_arms) {
    send(role, action, reported_.of(role), settings_.setpoint_lifetime);
  }
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
  bus().publish(
      role == ArmRole::replica ? channels::arm_command_replica : channels::arm_command_sensor,
      command);
}

// ---- what is told ----

void TestbedNode::publish_truth(const Truth& truth) {
  ground_truth_t message{};
  message.utime = truth.utime;
  message.seq = ++truth_seq_;
  message.session = session();
  set_pose(truth.pose, message.position_m, message.q_wxyz);
  for (int row = 0; row < 6; ++row) {
    for (int column = 0; column < 6; ++column) {
      message.covariance[6 * row + column] = truth.covariance(row, column);
    }
  }
  for (int i = 0; i < 3; ++i) {
    message.linear_velocity_m_s[i] = truth.velocity.linear[i];
    message.angular_velocity_rad_s[i] = truth.velocity.angular[i];
  }
  message.basis = "nominal";
  message.calibration_hash = calibration_hash_;
  bus().publish(channels::ground_truth, message);
}

testbed_state_t TestbedNode::current_state() const {
  testbed_state_t state{};
  state.utime = now();
  state.session = session();
  if (verdict_.level == Level::fault) {
    state.state = testbed_state_t::FAULT;
    state.reason = verdict_.reason;
  } else if (mode_ != Mode::idle && held_) {
    state.state = testbed_state_t::HELD;
    state.reason = hold_reason_;
  } else if (mode_ != Mode::idle && (verdict_.level != Level::good || !guidance_reason_.empty())) {
    state.state = testbed_state_t::HOLDING;
    state.reason = verdict_.level != Level::good ? verdict_.reason : guidance_reason_;
  } else if (mode_ == Mode::idle) {
    state.state =
        verdict_.level == Level::good ? testbed_state_t::IDLE : testbed_state_t::NOT_READY;
    state.reason = verdict_.reason;
  } else {
    state.state =
        mode_ == Mode::closed_loop ? testbed_state_t::CLOSED_LOOP : testbed_state_t::MOVING;
  }
  if (lease_.held(now())) {
    state.lease_holder = lease_.holder();
    state.lease_utime_expires = lease_.expires();
  }
  state.command_seq = command_seq_;
  state.finished_seq = finished_seq_;
  state.refused_seq = refused_seq_;
  state.refusal = refusal_;
  return state;
}

/// At its period, or when something changed that somebody may wait for.
void TestbedNode::publish_state(bool if_changed) {
  testbed_state_t state = current_state();
  if (if_changed && state.state == published_.state &&
      state.lease_holder == published_.lease_holder && override_ == published_.speed_override &&
      state.command_seq == published_.command_seq &&
      state.finished_seq == published_.finished_seq &&
      state.refused_seq == published_.refused_seq) {
    return;
  }
  state.seq = ++state_seq_;
  if (mode_ == Mode::closed_loop) {
    state.progress = guidance_.progress();
    state.remaining_s = guidance_.remaining() / override_;
  } else if (task_.motion && task_.motion->duration() > 0) {
    state.progress = task_.time / task_.motion->duration();
    state.remaining_s = (task_.motion->duration() - task_.time) / override_;
  }
  state.speed_override = override_;
  if (!if_changed && --clearance_countdown_ < 0 && reported_valid_[0] && reported_valid_[1]) {
    clearance_countdown_ = clearance_every - 1;
    constexpr double beyond = 10;
    const double least = clearance_.least_distance(reported_, beyond);
    clearance_m_ = least < beyond ? least : -1;
  }
  state.clearance_m = clearance_m_;
  const auto age = guidance_.estimate_age(now());
  state.estimate_age_s = age ? seconds(*age) : -1;
  set_pose(relative(commanded_), state.commanded_position_m, state.commanded_q_wxyz);
  for (int i = 0; i < 3; ++i) {
    state.commanded_velocity_m_s[i] = commanded_velocity_.linear[i];
    state.commanded_angular_velocity_rad_s[i] = commanded_velocity_.angular[i];
  }
  published_ = state;
  bus().publish(channels::testbed_state, state);
  count("truth_skipped", static_cast<double>(truth_.skipped()));
  switch (state.state) {
    case testbed_state_t::NOT_READY:
      return report(node_status_t::STARTING, state.reason);
    case testbed_state_t::FAULT:
      return report(node_status_t::FAULT, state.reason);
    case testbed_state_t::HOLDING:
    case testbed_state_t::HELD:
      return report(node_status_t::DEGRADED, state.reason);
    case testbed_state_t::IDLE:
      return report(node_status_t::READY);
    default:
      return report(node_status_t::RUNNING);
  }
}

std::unique_ptr<Node> make_testbed_node(NodeSetup setup, const RunSetup& run, Bus& bus,
                                        Loop& loop) {
  const std::filesystem::path layout = run.layout_file();
  const std::filesystem::path settings = run.config / "testbed.yaml";
  Cell cell = load_cell(run);
  // what truth rests on: the layout, its arms, and the sigmas
  std::string hashes = sha256_of_file(layout) + sha256_of_file(settings);
  Config files = Config::load(layout);
  for (const ArmRole role : both_arms) {
    hashes += sha256_of_file(run.config / files.section(name_of(role)).text("arm"));
  }
  Settings limits = load_settings(settings, cell);
  return std::make_unique<TestbedNode>(std::move(setup), std::move(cell), std::move(limits),
                                       sha256(hashes), bus, loop);
}

}  // namespace berth
