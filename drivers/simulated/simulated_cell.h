// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/ground_truth_t.hpp>
#include <berth/injection_t.hpp>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "common/bus/node.h"
#include "common/core/cell.h"
#include "common/core/lidar_profile.h"
#include "common/core/run_setup.h"
#include "drivers/arm/register_map.h"
#include "drivers/devices.h"
#include "drivers/facility/plc_map.h"
#include "drivers/simulated/cell_scene.h"
#include "drivers/simulated/injection.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "drivers/simulated/simulated_controller.h"
#include "drivers/simulated/simulated_instruments.h"
#include "drivers/simulated/simulated_plc.h"
#include "drivers/simulated/simulation_settings.h"

namespace lcm {
class LogFile;
}

namespace berth {

/// The log of the replica's true poses: channel WORLD_TRUTH in stock LCM format, a file next to the
/// run's log. It is not published on the bus.
class WorldTruthLog {
 public:
  /// @throws InputError when the file cannot be written.
  explicit WorldTruthLog(const std::filesystem::path& file);
  ~WorldTruthLog();

  void write(const ground_truth_t& truth);

 private:
  std::vector<char> unwritten_;  // the file's own buffer, which it needs until it is closed
  std::unique_ptr<lcm::LogFile> log_;
  std::vector<unsigned char> message_;
};

/// All hardware of the cell, simulated: one scene and one clock, two arm controllers, the PLC and
/// the LIDAR, each served at its address of devices.yaml. On the bus it is a node like others: it
/// takes INJECTION, publishes the devices' faults in INJECTION_STATE, and writes the truth to
/// world_truth.lcm alone.
class SimulatedCell final : public Node {
 public:
  struct Setup {
    Cell cell;  ///< by its configuration files
    Devices devices;
    RegisterMap replica_map;
    RegisterMap sensor_map;
    PlcMap plc_map;
    SimulationSettings settings;
    LidarProfile lidar_profile;
    SimulatedLidarSettings lidar;
    std::uint64_t seed = 1;
    TrackerSetup tracker;
    std::filesystem::path out;  ///< where the world's truth is written; empty: nowhere
  };

  /// @throws InputError when an address cannot be listened on.
  SimulatedCell(NodeSetup node, const Setup& setup, Bus& bus, Loop& loop);
  ~SimulatedCell() override;

  SimulatedController& controller(ArmRole role) {
    return role == ArmRole::replica ? replica_ : sensor_;
  }
  SimulatedPlc& plc() { return plc_; }
  SimulatedLidar& lidar() { return lidar_; }
  /// The true cell: takes true joints.
  const Cell& world() const { return world_; }
  /// True T_sensor_model, at any time of the last half second up to now.
  Pose true_relative_pose(Utime t);

 private:
  void write_truth();
  void show_counters();
  void on_injection(const injection_t& injection);
  void carry_out(const injection_t& injection);
  void advance_faults();
  void publish_faults();

  ArmErrors replica_errors_;
  ArmErrors sensor_errors_;
  TrueTarget target_;
  Cell world_;
  RelativePose relative_pose_;
  SimulatedController replica_;
  SimulatedController sensor_;
  SimulatedPlc plc_;
  CellScene scene_;
  SimulatedLidar lidar_;
  FaultTable faults_;
  std::map<std::string, std::int64_t> last_seq_;  // of each commander's injections
  std::int64_t accepted_seq_ = 0;
  std::int64_t refused_seq_ = 0;
  std::string refusal_;
  std::int64_t fault_state_seq_ = 0;
  Loop::TimerId fault_timer_ = 0;
  std::optional<WorldTruthLog> truth_;
  std::optional<SimulatedTracker> tracker_;
  std::optional<SimulatedInertial> inertial_;
  std::int64_t truth_seq_ = 0;
  Loop::TimerId truth_timer_ = 0;
  Loop::TimerId counter_timer_ = 0;
};

/// Reads everything from RunSetup::config. @throws InputError.
std::unique_ptr<Node> make_simulated_cell(NodeSetup node, const RunSetup& run, Bus& bus,
                                          Loop& loop);
/// What make_simulated_cell reads.
SimulatedCell::Setup load_simulated_cell(const RunSetup& run);

}  // namespace berth
