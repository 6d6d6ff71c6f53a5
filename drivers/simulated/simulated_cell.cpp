// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_cell.h"

#include <berth/injection_state_t.hpp>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/text.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"

namespace berth {

WorldTruthLog::WorldTruthLog(const std::filesystem::path& file)
    : unwritten_(1 << 16), log_(std::make_unique<lcm::LogFile>(file.string(), "w")) {
  if (!log_->good()) throw InputError(file.string() + ": cannot be written");
  std::setvbuf(log_->getFilePtr(), unwritten_.data(), _IOFBF, unwritten_.size());
}

WorldTruthLog::~WorldTruthLog() = default;

void WorldTruthLog::write(const ground_truth_t& truth) {
  message_.resize(static_cast<std::size_t>(truth.getEncodedSize()));
  const int size = static_cast<int>(message_.size());
  truth.encode(message_.data(), 0, size);
  lcm::LogEvent event{};
  event.timestamp = truth.utime;
  event.channel = channels::world_truth;
  event.datalen = size;
  event.data = message_.data();
  log_->writeEvent(&event);
}

namespace {

constexpr Utime truth_period = 10 * millisecond;
constexpr Utime velocity_span = 8 * millisecond;

std::string text_of(const std::vector<std::string>& faults) {
  std::string text;
  for (const std::string& fault : faults) text += (text.empty() ? "" : "; ") + fault;
  return text.empty() ? "none" : text;
}

/// Options of the controllers, with the program that the world defines.
SimulatedController::Options as_it_runs(const SimulatedCell::Setup& setup) {
  SimulatedController::Options options = setup.settings.controller;
  options.robot.program = setup.settings.world.program;
  options.robot.cnt = setup.settings.world.cnt;
  return options;
}

/// Settings of the LIDAR, with the errors of the world.
SimulatedLidarSettings as_it_is(const SimulatedCell::Setup& setup) {
  SimulatedLidarSettings lidar = setup.lidar;
  const LidarErrors errors = draw_lidar_errors(setup.settings.world, setup.seed);
  lidar.clock_offset += errors.clock;
  lidar.receiver.errors = errors.scanner;
  return lidar;
}

}  // namespace

SimulatedCell::SimulatedCell(NodeSetup node, const Setup& setup, Bus& bus, Loop& loop)
    : Node(std::move(node), bus, loop),
      replica_errors_(draw_errors(setup.settings.world.cell, setup.cell.replica, setup.seed)),
      sensor_errors_(draw_errors(setup.settings.world.cell, setup.cell.sensor, setup.seed)),
      target_(draw_true_target(setup.cell.target, setup.settings.world.target, setup.seed)),
      world_(perturbed_cell(setup.cell, target_.target, replica_errors_, sensor_errors_)),
      relative_pose_(world_),
      replica_(setup.devices.replica_arm.address, setup.replica_map, setup.cell.replica,
               replica_errors_, as_it_runs(setup), loop),
      sensor_(setup.devices.sensor_arm.address, setup.sensor_map, setup.cell.sensor, sensor_errors_,
              as_it_runs(setup), loop),
      plc_(setup.devices.plc.address, setup.plc_map, setup.settings.plc, loop,
           [this](bool estop_closed, bool fence_closed) {
             replica_.set_safety(estop_closed, fence_closed);
             sensor_.set_safety(estop_closed, fence_closed);
           }),
      scene_(
          world_, [this](Utime t) { return replica_.true_joints(t); },
          [this](Utime t) { return sensor_.true_joints(t); }, setup.lidar.scene),
      lidar_(setup.devices.lidar.address, setup.lidar_profile, as_it_is(setup), setup.seed, loop,
             scene_),
      faults_(cell_faults(replica_, sensor_, plc_, lidar_, scene_)) {
  scene_.set_sun_lamp([this] {
    return SunLamp{plc_.sun_lamp(), plc_.sun_azimuth(), plc_.sun_elevation(), plc_.albedo_lamp()};
  });
  bus.subscribe<injection_t>(channels::injection, Queue::fifo(),
                             [this](const injection_t& injection) { on_injection(injection); });
  if (!setup.out.empty()) {
    write_file(setup.out / "world.yaml",
               text_of(replica_errors_, sensor_errors_, target_,
                       draw_lidar_errors(setup.settings.world, setup.seed)));
    truth_.emplace(setup.out / "world_truth.lcm");
    truth_timer_ = loop.every(truth_period, [this] { write_truth(); });
    if (setup.settings.tracker.write) {
      tracker_.emplace(
          setup.tracker, setup.settings.tracker, setup.seed,
          [this](ArmRole role, Utime t) {
            return role == ArmRole::replica ? world_.replica.tool_pose(replica_.true_joints(t))
                                            : world_.sensor.tool_pose(sensor_.true_joints(t));
          },
          loop, setup.out / "tracker.csv");
    }
  }
  if (setup.settings.inertial.publish) {
    inertial_.emplace(
        setup.settings.inertial, setup.seed,
        [this](Utime t) { return world_.sensor.tool_pose(sensor_.true_joints(t)); }, loop,
        [this](inertial_motion_t message) {
          message.session = session();
          this->bus().publish(channels::inertial_motion, message);
        });
  }
  counter_timer_ = loop.every(second, [this] {
    show_counters();
    publish_faults();
  });
  report(node_status_t::READY);
}

SimulatedCell::~SimulatedCell() {
  loop().cancel(truth_timer_);
  loop().cancel(counter_timer_);
  loop().cancel(fault_timer_);
}

Pose SimulatedCell::true_relative_pose(Utime t) {
  return relative_pose_.at(replica_.true_joints(t), sensor_.true_joints(t));
}

void SimulatedCell::write_truth() {
  const Utime t = now();
  const Pose pose = true_relative_pose(t);
  const Velocity velocity =
      velocity_between(true_relative_pose(t - velocity_span), pose, seconds(velocity_span));
  ground_truth_t truth{};
  truth.utime = t;
  truth.seq = ++truth_seq_;
  truth.session = session();
  set_pose(with_positive_w(pose), truth);
  set_velocity(velocity, truth);
  truth.basis = "world";
  truth_->write(truth);
}

void SimulatedCell::on_injection(const injection_t& injection) {
  if (injection.session != session()) {
    event(event_t::WARNING, "injection-of-another-session",
          "an injection of '" + injection.commander + "' belongs to session " +
              std::to_string(injection.session) + " and changes nothing");
    return;
  }
  if (now() > injection.utime_expires) {
    event(event_t::WARNING, "injection-expired",
          "an injection of '" + injection.commander + "' came " +
              fixed(seconds(now() - injection.utime_expires), 1) +
              " s too late and changes nothing");
    return;
  }
  std::int64_t& last = last_seq_[injection.commander];
  if (injection.seq > last) {
    last = injection.seq;
    carry_out(injection);
  }
  publish_faults();  // also to a repetition: its commander may have missed the answer
}

void SimulatedCell::carry_out(const injection_t& injection) {
  std::string refusal;
  switch (injection.action) {
    case injection_t::INJECT:
      refusal = faults_.inject(injection.device, injection.fault, injection.value,
                               injection.duration_s, now());
      break;
    case injection_t::CLEAR:
      refusal = faults_.clear(injection.device, injection.fault);
      break;
    case injection_t::CLEAR_ALL:
      faults_.clear_all();
      break;
    default:
      refusal = "action " + std::to_string(injection.action) +
                " is not known; actions are 0 inject, 1 clear, 2 clear all";
  }
  if (!refusal.empty()) {
    refused_seq_ = injection.seq;
    refusal_ = refusal;
    event(event_t::WARNING, "injection-refused", refusal);
    return;
  }
  accepted_seq_ = injection.seq;
  const std::string what =
      injection.action == injection_t::CLEAR_ALL
          ? "all faults cleared"
          : injection.device + ": " + (injection.fault.empty() ? "all" : injection.fault) +
                (injection.action == injection_t::INJECT ? " injected" : " cleared");
  event(event_t::NOTICE, "injection", what + " by '" + injection.commander + "'");
  advance_faults();
}

/// Clears faults that are due, and schedules the next call.
void SimulatedCell::advance_faults() {
  if (faults_.advance(now())) {
    event(event_t::NOTICE, "injection",
          "a fault is over; now there are: " + text_of(faults_.active()));
    publish_faults();
  }
  loop().cancel(fault_timer_);
  fault_timer_ = 0;
  if (const Utime next = faults_.next_change(); next != 0) {
    fault_timer_ = loop().at(next, [this] { advance_faults(); });
  }
}

void SimulatedCell::publish_faults() {
  injection_state_t state{};
  state.utime = now();
  state.seq = ++fault_state_seq_;
  state.session = session();
  state.accepted_seq = accepted_seq_;
  state.refused_seq = refused_seq_;
  state.refusal = refusal_;
  state.active = faults_.active();
  state.active_count = static_cast<std::int32_t>(state.active.size());
  bus().publish(channels::injection_state, state);
}

void SimulatedCell::show_counters() {
  count("beams_fired", static_cast<double>(lidar_.beams_fired()));
  count("replica_controller_state", static_cast<double>(replica_.state()));
  count("sensor_controller_state", static_cast<double>(sensor_.state()));
}

SimulatedCell::Setup load_simulated_cell(const RunSetup& run) {
  SimulatedCell::Setup setup;
  setup.cell = load_cell(run);
  setup.devices = load_devices(run.config);
  const auto registers = [&](const std::string& name) {
    return run.config / "registers" / (name + ".yaml");
  };
  setup.replica_map = RegisterMap::load(registers(setup.devices.replica_arm.registers));
  setup.sensor_map = RegisterMap::load(registers(setup.devices.sensor_arm.registers));
  setup.plc_map = PlcMap::load(registers(setup.devices.plc.registers));
  setup.settings = load_simulation(run.config / "simulation.yaml");
  setup.lidar_profile = load_lidar_profile(run, setup.devices.lidar.model);
  setup.lidar = load_simulated_lidar(run.config / "simulation_lidar.yaml");
  const std::string& lidar = setup.cell.lidar;
  const std::string model = lidar.empty() ? setup.devices.lidar.model : lidar;
  read_receiver(run.config / "lidars" / (model + ".yaml"), setup.lidar.receiver);
  setup.seed = run.seed;
  setup.tracker = load_tracker_setup(run.config / "tracker.yaml");
  setup.out = run.out;
  return setup;
}

std::unique_ptr<Node> make_simulated_cell(NodeSetup node, const RunSetup& run, Bus& bus,
                                          Loop& loop) {
  return std::make_unique<SimulatedCell>(std::move(node), load_simulated_cell(run), bus, loop);
}

}  // namespace berth
