// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_command_t.hpp>
#include <berth/estimator_state_t.hpp>
#include <berth/facility_command_t.hpp>
#include <berth/facility_state_t.hpp>
#include <berth/heartbeat_t.hpp>
#include <berth/injection_state_t.hpp>
#include <berth/injection_t.hpp>
#include <berth/lidar_state_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <berth/testbed_command2_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <set>
#include <vector>

#include "common/bus/commands.h"
#include "common/bus/node.h"
#include "common/bus/simulation.h"
#include "lcmtypes/channels.h"
#include "test/evaluation/measure/made_run.h"

namespace berth::fake {

inline constexpr std::int64_t session = made::session;

/// Scripts for the nodes below: what goes wrong, and when (seconds after the start; never:
/// negative).
struct Script {
  double ready_after_s = 0.5;
  double position_error_m = 4e-3;  ///< of every estimate
  double acquire_takes_s = 2;
  double lost_from_s = -1;     ///< no good estimate from then on
  double certain_from_s = -1;  ///< estimates are ok, their covariances zero
  double seen_again_s = -1;    ///< until then; never: the target stays lost
  int late_refusals = 0;       ///< of estimator commands
  int commands_lost = 0;       ///< of the testbed's, on the way
  std::string refuse_moves;    ///< reason
  std::string other_holder;    ///< of the lease
  double testbed_fault_from_s = -1;
  double lease_lost_from_s = -1;
  double estimator_fault_from_s = -1;
  double lidar_silent_from_s = -1;
  std::string refuse_scans;  ///< that a procedure requests
  bool truth = true;
  bool attended = true;
  bool lamps_work = true;
  std::string refuse_lamps;   ///< reason
  int lamp_command_lost = 0;  ///< which of them, from 1
  double lamp_turns_s = 0;    ///< how long it takes
  double move_takes_s = 2;
  double stop_takes_s = 0;
  double moved_on_hold_m = 0;  ///< by hand, once it stands
  bool estop_closed = true;
  bool simulated_cell = false;  ///< there is one that takes injections
  std::string refuse_injections;
};

class Clocked : public Node {
 public:
  Clocked(const std::string& name, const Script& script, Bus& the_bus, Loop& the_loop)
      : Node({name, fake::session, "hash"}, the_bus, the_loop), script_(script), born_(now()) {
    loop().after(utime_from_seconds(script.ready_after_s),
                 [this] { report(node_status_t::READY); });
  }

 protected:
  bool since(double from_s) const { return from_s >= 0 && seconds(now() - born_) >= from_s; }

  const Script& script_;
  Utime born_;
};

class Testbed final : public Clocked {
 public:
  Testbed(const Script& script, Bus& the_bus, Loop& the_loop)
      : Clocked("testbed", script, the_bus, the_loop) {
    bus().subscribe<testbed_command2_t>(channels::testbed_command, Queue::fifo(),
                                        [this](const testbed_command2_t& c) { take(c); });
    state_.session = fake::session;
    state_.state = testbed_state_t::IDLE;
    state_.clearance_m = 1;
    state_.speed_override = 1;
    bus().subscribe<procedure_state_t>(
        channels::procedure_state, Queue::fifo(),
        [this](const procedure_state_t& s) { stand(s.state == procedure_state_t::HELD); });
    loop().every(100 * millisecond, [this] { publish(); });
    if (script.truth) loop().every(8 * millisecond, [this] { publish_truth(); });
  }

  std::vector<testbed_command2_t> obeyed;
  double speed_override = 1;  ///< as last commanded, with whatever command

 private:
  void take(const testbed_command2_t& c) {
    if (lost_ < script_.commands_lost) {
      ++lost_;
      return;
    }
    if (c.session != fake::session || now() > c.utime_expires) return;
    state_.speed_override = speed_override = c.speed_override;
    switch (c.command) {
      case testbed_command2_t::TAKE_LEASE:
        if (!script_.other_holder.empty()) {
          state_.lease_holder = script_.other_holder;
        } else {
          state_.lease_holder = c.commander;
        }
        lease_kept_ = now();
        return publish();
      case testbed_command2_t::KEEP_LEASE:
        lease_kept_ = now();
        return;
      case testbed_command2_t::RELEASE_LEASE:
        state_.lease_holder.clear();
        obeyed.push_back(c);
        return publish();
      default:
        break;
    }
    if (c.seq <= last_seq_) return publish();
    last_seq_ = c.seq;
    obeyed.push_back(c);
    begin(c);
    publish();
  }

  void begin(const testbed_command2_t& c) {
    switch (c.command) {
      case testbed_command2_t::HOLD:
        if (state_.state == testbed_state_t::IDLE) break;
        state_.state = testbed_state_t::HELD;
        report(node_status_t::DEGRADED, "held");
        break;
      case testbed_command2_t::RESUME:
        if (state_.state != testbed_state_t::HELD) return refuse(c, "nothing is held");
        state_.state = testbed_state_t::MOVING;
        report(node_status_t::RUNNING);
        break;
      case testbed_command2_t::STOP:
        if (script_.stop_takes_s > 0 && state_.state == testbed_state_t::MOVING) {
          motion_seq_ = c.seq;
          motion_left_ = utime_from_seconds(script_.stop_takes_s);
          break;
        }
        [[fallthrough]];
      case testbed_command2_t::RESET:
        state_.state = testbed_state_t::IDLE;
        motion_seq_ = 0;
        state_.finished_seq = c.seq;
        break;
      default:
        if (!script_.refuse_moves.empty()) return refuse(c, script_.refuse_moves);
        if (state_.state != testbed_state_t::IDLE) return refuse(c, "busy");
        state_.state = testbed_state_t::MOVING;
        motion_seq_ = c.seq;
        motion_left_ = utime_from_seconds(script_.move_takes_s);
    }
    state_.command_seq = c.seq;
  }

  void refuse(const testbed_command2_t& c, const std::string& why) {
    state_.refused_seq = c.seq;
    state_.refusal = why;
  }

  void publish() {
    if (since(script_.testbed_fault_from_s)) {
      state_.state = testbed_state_t::FAULT;
      state_.reason = "made to fail";
    }
    const bool silent = now() - lease_kept_ > 2 * second;
    if (since(script_.lease_lost_from_s) || silent) state_.lease_holder.clear();
    if (motion_seq_ != 0 && state_.state == testbed_state_t::MOVING) {
      motion_left_ -= now() - published_;
      if (motion_left_ <= 0) {
        state_.state = testbed_state_t::IDLE;
        state_.finished_seq = motion_seq_;
        motion_seq_ = 0;
      }
    }
    published_ = now();
    state_.utime = now();
    ++state_.seq;
    bus().publish(channels::testbed_state, state_);
  }

  /// On hold the flight stands still.
  void stand(bool stands) {
    if (stands && stands_since_ == 0) stands_since_ = now();
    if (!stands && stands_since_ != 0) {
      stood_ += now() - stands_since_;
      stands_since_ = 0;
    }
  }

  void publish_truth() {
    const Utime then = now() - 20 * millisecond;
    const bool stands = stands_since_ != 0 && then > stands_since_;
    Pose pose = made::flight(seconds((stands ? stands_since_ : then) - stood_ - born_));
    if (stands && then - stands_since_ > second) pose.position.z() += script_.moved_on_hold_m;
    auto message = made::truth(then, pose);
    message.seq = ++truth_seq_;
    bus().publish(channels::ground_truth, message);
  }

  testbed_state_t state_{};
  std::int64_t last_seq_ = 0;
  std::int64_t motion_seq_ = 0;
  Utime motion_left_ = 0;
  Utime published_ = 0;
  Utime lease_kept_ = 0;
  std::int64_t truth_seq_ = 0;
  Utime stands_since_ = 0;
  Utime stood_ = 0;
  int lost_ = 0;
};

class Estimator final : public Clocked {
 public:
  Estimator(const Script& script, Bus& the_bus, Loop& the_loop)
      : Clocked("estimator", script, the_bus, the_loop) {
    bus().subscribe<estimator_command_t>(channels::estimator_command, Queue::fifo(),
                                         [this](const estimator_command_t& c) { take(c); });
    state_.session = fake::session;
    loop().every(second, [this] { publish(); });
    loop().every(500 * millisecond, [this] { scan(); });
  }

  std::vector<estimator_command_t> obeyed;

 private:
  void take(const estimator_command_t& c) {
    if (c.seq <= last_seq_) return publish();
    last_seq_ = c.seq;
    if (refusals_ < script_.late_refusals) {
      ++refusals_;
      state_.refused_seq = c.seq;
      state_.scan_id = c.first_scan_id;  // is requested already
      state_.reason = "too late";
      return publish();
    }
    obeyed.push_back(c);
    state_.command_seq = c.seq;
    if (c.command == estimator_command_t::ACQUIRE) {
      state_.mode = estimator_state_t::ACQUIRING;
      began_ = now();
    } else if (c.command == estimator_command_t::TRACK) {
      state_.mode = estimator_state_t::TRACKING;
    } else {
      state_.mode = estimator_state_t::IDLE;
    }
    publish();
  }

  /// An estimate for 300 ms ago, when the scan was half done.
  void scan() {
    if (since(script_.estimator_fault_from_s)) report(node_status_t::FAULT, "made to fail");
    if (state_.mode == estimator_state_t::IDLE) return;
    ++state_.scan_id;
    const Utime then = now() - 300 * millisecond;
    Pose pose = made::flight(seconds(then - born_));
    pose.position.z() += script_.position_error_m;
    std::int8_t status = pose_estimate_t::OK;
    if (state_.mode == estimator_state_t::ACQUIRING) {
      if (seconds(now() - began_) < script_.acquire_takes_s) {
        status = pose_estimate_t::ACQUIRING;
      } else {
        state_.mode = estimator_state_t::TRACKING;
      }
    }
    if (since(script_.lost_from_s) && !since(script_.seen_again_s)) status = pose_estimate_t::LOST;
    auto message = made::estimate(then, pose, status);
    message.seq = ++estimate_seq_;
    message.command_seq = state_.command_seq;
    message.scan_id = state_.scan_id;
    if (status != pose_estimate_t::OK) message.reason = "made so";
    if (since(script_.certain_from_s)) Matrix6d::Map(message.covariance).setZero();
    bus().publish(channels::pose_estimate, message);
  }

  void publish() {
    state_.utime = now();
    ++state_.seq;
    bus().publish(channels::estimator_state, state_);
  }

  estimator_state_t state_{};
  std::int64_t last_seq_ = 0;
  std::int64_t estimate_seq_ = 0;
  Utime began_ = 0;
  int refusals_ = 0;
};

class Facility final : public Clocked {
 public:
  Facility(const Script& script, Bus& the_bus, Loop& the_loop)
      : Clocked("facility-driver", script, the_bus, the_loop) {
    bus().subscribe<facility_command_t>(
        channels::facility_command, Queue::fifo(), [this](const facility_command_t& c) {
          if (!script_.lamps_work) return;
          if (++received == script_.lamp_command_lost) return;
          if (!answers_.is_new(c)) return;
          if (!script_.refuse_lamps.empty()) return answers_.refuse(c, script_.refuse_lamps);
          answers_.accept(c);
          const bool turns = last.sun_azimuth_rad != c.sun_azimuth_rad ||
                             last.sun_elevation_rad != c.sun_elevation_rad;
          if (turns) {
            turned_ = now() + utime_from_seconds(script_.lamp_turns_s);
          }
          last = c;
          state_.sun_lamp = c.sun_lamp;
          state_.albedo_lamp = c.albedo_lamp;
        });
    state_.session = fake::session;
    state_.valid = true;
    loop().every(100 * millisecond, [this] {
      state_.utime = now();
      ++state_.seq;
      state_.estop_chain_closed = script_.estop_closed;
      state_.fence_closed = true;
      if (now() >= turned_) {
        state_.sun_azimuth_rad = last.sun_azimuth_rad;
        state_.sun_elevation_rad = last.sun_elevation_rad;
      }
      bus().publish(channels::facility_state, state_);
    });
  }

  double sun() const { return state_.sun_lamp; }
  facility_command_t last{};
  int received = 0;

 private:
  CommandAnswers answers_{bus(), loop(), channels::facility_answers, fake::session};
  facility_state_t state_{};
  Utime turned_ = 0;
};

/// Only beats and reports that it is idle, until it falls silent: what a killed process looks like.
class LidarDriver {
 public:
  LidarDriver(const Script& script, Bus& bus, Loop& loop) : born_(loop.now()) {
    bus.subscribe<estimator_command_t>(channels::estimator_command, Queue::fifo(),
                                       [this, &script](const estimator_command_t& c) {
                                         if (c.command != estimator_command_t::SCAN) return;
                                         scan_id_ = c.first_scan_id;
                                         reason_ = script.refuse_scans;
                                       });
    loop.every(50 * millisecond, [this, &script, &bus, &loop] {
      const double age = seconds(loop.now() - born_);
      if (script.lidar_silent_from_s >= 0 && age >= script.lidar_silent_from_s) return;
      heartbeat_t beat{};
      beat.utime = loop.now();
      beat.session = session;
      beat.node = "lidar-driver";
      bus.publish(channels::heartbeat, beat);
      node_status_t status{};
      status.utime = loop.now();
      status.session = session;
      status.node = "lidar-driver";
      status.state = age < script.ready_after_s ? node_status_t::STARTING : node_status_t::READY;
      bus.publish(channels::node_status, status);
      lidar_state_t lidar{};
      lidar.utime = loop.now();
      lidar.session = session;
      lidar.state = lidar_state_t::IDLE;
      lidar.scan_id = scan_id_;
      lidar.reason = reason_;
      lidar.progress = scan_id_ > 0 && reason_.empty() ? 1 : 0;
      bus.publish(channels::lidar_state, lidar);
    });
  }

 private:
  Utime born_;
  std::int64_t scan_id_ = 0;
  std::string reason_;
};

/// Takes injections, as the simulated cell does.
class SimulatedCell final : public Clocked {
 public:
  SimulatedCell(const Script& script, Bus& the_bus, Loop& the_loop)
      : Clocked("simulated-cell", script, the_bus, the_loop) {
    bus().subscribe<injection_t>(channels::injection, Queue::fifo(),
                                 [this](const injection_t& i) { take(i); });
    state_.session = fake::session;
    loop().every(second, [this] { publish(); });
  }

  std::vector<injection_t> obeyed;

 private:
  void take(const injection_t& i) {
    if (++received_ == 1) return;  // the first one is lost on the way
    if (i.seq > last_seq_) {
      last_seq_ = i.seq;
      if (script_.refuse_injections.empty()) {
        obeyed.push_back(i);
        state_.accepted_seq = i.seq;
      } else {
        state_.refused_seq = i.seq;
        state_.refusal = script_.refuse_injections;
      }
    }
    publish();
  }

  void publish() {
    state_.utime = now();
    ++state_.seq;
    bus().publish(channels::injection_state, state_);
  }

  injection_state_t state_{};
  std::int64_t last_seq_ = 0;
  int received_ = 0;
};

}  // namespace berth::fake
