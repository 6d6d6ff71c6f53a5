// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_cell.h"

namespace berth {
namespace {

constexpr Utime truth_period = 10 * millisecond;
constexpr Utime velocity_span = 8 * millisecond;

}  // namespace

SimulatedCell::SimulatedCell(NodeSetup node, const Setup& setup, Bus& bus, Loop& loop, Wires& wires)
    : Node(std::move(node), bus, loop),
      replica_errors_(draw_errors(setup.settings.perturbation, setup.cell.replica, setup.seed)),
      sensor_errors_(draw_errors(setup.settings.perturbation, setup.cell.sensor, setup.seed)),
      world_(perturbed_cell(setup.cell, replica_errors_, sensor_errors_)),
      replica_(setup.devices.replica_arm.address, setup.replica_map, setup.cell.replica,
               replica_errors_, setup.settings.controller, loop, wires),
      sensor_(setup.devices.sensor_arm.address, setup.sensor_map, setup.cell.sensor, sensor_errors_,
              setup.settings.controller, loop, wires),
      plc_(setup.devices.plc.address, setup.plc_map, setup.settings.plc, loop, wires,
           [this](bool estop_closed, bool fence_closed) {
             replica_.set_safety(estop_closed, fence_closed);
             sensor_.set_safety(estop_closed, fence_closed);
           }),
      scene_(
          world_, [this](Utime t) { return replica_.true_joints(t); },
          [this](Utime t) { return sensor_.true_joints(t); }, setup.lidar.scene),
      lidar_(setup.devices.lidar.address, setup.lidar_profile, setup.lidar, setup.seed, loop, wires,
             scene_) {
  if (!setup.world_truth.empty()) {
    truth_.emplace(setup.world_truth);
    truth_timer_ = loop.every(truth_period, [this] { write_truth(); });
  }
  counter_timer_ = loop.every(second, [this] { show_counters(); });
  report(node_status_t::READY);
}

SimulatedCell::~SimulatedCell() {
  loop().cancel(truth_timer_);
  loop().cancel(counter_timer_);
}

Pose SimulatedCell::true_relative_pose(Utime t) {
  return world_.relative_pose(replica_.true_joints(t), sensor_.true_joints(t));
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
  const double q[4] = {pose.rotation.w(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z()};
  const double sign = q[0] < 0 ? -1 : 1;
  for (int i = 0; i < 4; ++i) truth.q_wxyz[i] = sign * q[i];
  for (int i = 0; i < 3; ++i) {
    truth.position_m[i] = pose.position[i];
    truth.linear_velocity_m_s[i] = velocity.linear[i];
    truth.angular_velocity_rad_s[i] = velocity.angular[i];
  }
  truth.basis = "world";
  truth_->write(truth);
}

void SimulatedCell::show_counters() {
  count("beams_fired", static_cast<double>(lidar_.beams_fired()));
  count("replica_controller_state", static_cast<double>(replica_.state()));
  count("sensor_controller_state", static_cast<double>(sensor_.state()));
}

SimulatedCell::Setup load_simulated_cell(const RunSetup& run) {
  SimulatedCell::Setup setup;
  setup.cell = load_cell(run.config / "layouts" / (run.layout + ".yaml"),
                         load_target(run.target, run.target_length));
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
  setup.seed = run.seed;
  if (!run.out.empty()) setup.world_truth = run.out / "world_truth.lcm";
  return setup;
}

std::unique_ptr<Node> make_simulated_cell(NodeSetup node, const RunSetup& run, Bus& bus, Loop& loop,
                                          Wires& wires) {
  return std::make_unique<SimulatedCell>(std::move(node), load_simulated_cell(run), bus, loop,
                                         wires);
}

}  // namespace berth
