// SPDX-License-Identifier: BSD-3-Clause
// What goes wrong, how it is put right, and what is promised.
#include <algorithm>
#include <cmath>

#include "test/testbed/safety/drill.h"

namespace berth::drills {
namespace {

constexpr std::int8_t held = testbed_state_t::HELD;
constexpr std::int8_t holding = testbed_state_t::HOLDING;
constexpr std::int8_t fault = testbed_state_t::FAULT;
constexpr std::int8_t resume = testbed_command2_t::RESUME;
constexpr std::int8_t reset = testbed_command2_t::RESET;

std::function<void(World&)> injected(const std::string& device, const std::string& name,
                                     double value = 0) {
  return [=](World& world) { world.inject(device, name, value); };
}
std::function<void(World&)> killed(const std::string& node) {
  return [=](World& world) { world.kill(node); };
}
std::function<void(World&)> stopped(const std::string& node) {
  return [=](World& world) { world.stop(node); };
}
std::function<void(World&)> continued(const std::string& node) {
  return [=](World& world) { world.go_on(node); };
}
void cleared(World& world) { world.clear_faults(); }

/// Farther from its commanded position than a joint may be.
bool strays(World& world) { return world.lag() > radians(1.0); }

/// An estimate that is stated as good and is further from truth than the supervisor allows.
bool estimate_is_wrong(World& world) {
  const auto& estimate = world.estimate;
  if (!estimate || estimate->status != pose_estimate_t::OK) return false;
  const Pose truth = world.true_pose(estimate->utime);
  const Vector3d estimated(estimate->position_m[0], estimate->position_m[1],
                           estimate->position_m[2]);
  double variance = 0;
  for (int i = 0; i < 3; ++i) variance = std::max(variance, estimate->covariance[7 * i]);
  constexpr double margin = 0.15;          // safety.largest_estimate_error of config/testbed.yaml
  constexpr double truth_variance = 1e-6;  // ground_truth.position_sigma
  return (estimated - truth.position).norm() > margin + 4 * std::sqrt(variance + truth_variance);
}

std::vector<Drill> all() {
  const std::string by_itself = "by itself";
  const std::string by_resume = "RESUME";
  const std::string by_reset = "put right, RESET, RESUME";
  const std::string new_run = "a new run";
  std::vector<Drill> list;
  const auto open = [&](const std::string& name, std::function<void(World&)> begin,
                        std::function<void(World&)> mend, std::optional<std::int8_t> command,
                        const std::vector<std::string>& codes, std::int8_t state,
                        const std::string& resumes) {
    Drill drill;
    drill.name = name;
    drill.begin = std::move(begin);
    drill.mend = std::move(mend);
    drill.command = command;
    drill.codes = codes;
    drill.state = state;
    drill.resumes = resumes;
    list.push_back(std::move(drill));
    return &list.back();
  };
  const auto closed = [&](const std::string& name, std::function<void(World&)> begin,
                          std::function<void(World&)> mend, std::optional<std::int8_t> command,
                          const std::vector<std::string>& codes, std::int8_t state,
                          const std::string& resumes) {
    Drill* drill = open(name, std::move(begin), std::move(mend), command, codes, state, resumes);
    drill->closed_loop = true;
    return drill;
  };
  const std::optional<std::int8_t> nothing;
  const std::function<void(World&)> never;

  open("emergency stop", injected("plc", "estop"), cleared, reset, {"arm-estop"}, fault, by_reset);
  open("fence opened", injected("plc", "fence"), cleared, reset, {"arm-fault"}, fault, by_reset);
  open("controller stalls", injected("arm-replica", "stall"), cleared, resume, {"arm-fault"}, fault,
       by_resume);
  open("controller reboots", injected("arm-sensor", "reboot"), cleared, resume, {"arm-stopped"},
       held, by_resume);
  open("controller marks its joints invalid", injected("arm-replica", "invalid_position"), cleared,
       nothing, {"arm-silent"}, holding, by_itself);
  open("reported joints drift away", injected("arm-sensor", "report_drift", 0.1), never, nothing,
       {"arm-strays"}, held, new_run)
      ->contradicts = strays;
  open("reported joints jump", injected("arm-replica", "report_jump", 0.1), cleared, resume,
       {"arm-jumped"}, held, by_resume);
  open("controller runs away", injected("arm-replica", "runaway", 0.3), cleared, resume,
       {"arm-strays"}, held, by_resume)
      ->contradicts = strays;
  open("Modbus exceptions", injected("arm-replica", "exception", 4), cleared, resume,
       {"arm-stopped"}, held, by_resume);
  open("Modbus garbage", injected("arm-sensor", "garbage"), cleared, resume, {"arm-stopped"}, held,
       by_resume);
  open("Modbus half-open sockets", injected("arm-replica", "half_open"), cleared, resume,
       {"arm-stopped"}, held, by_resume);
  open("Modbus answers too late", injected("arm-sensor", "delayed", 0.07), cleared, resume,
       {"arm-stopped"}, held, by_resume);
  open("Modbus silent", injected("arm-replica", "silent"), cleared, resume, {"arm-stopped"}, held,
       by_resume);
  open("PLC silent", injected("plc", "silent"), cleared, nothing, {"facility-silent"}, holding,
       by_itself);
  open("PLC answers garbage", injected("plc", "garbage"), cleared, nothing, {"facility-silent"},
       holding, by_itself);
  closed("LIDAR silent mid-scan", injected("lidar", "silent"), cleared, nothing, {"scan-silent"},
         holding, by_itself);
  closed(
      "estimate wrong by 0.5 m",
      [](World& world) {
        world.estimate_falsely({0, 0, 0.5});
      },
      [](World& world) {
        world.estimate_falsely({0, 0, 0});
      },
      resume, {"estimate-wrong"}, held, by_resume)
      ->contradicts = estimate_is_wrong;
  closed(
      "LIDAR's ranges wander, 50 mm/s", [](World& world) { world.drift_ranges(0.05); },
      [](World& world) { world.drift_ranges(0); }, resume, {"estimate-wrong"}, held, by_resume)
      ->contradicts = estimate_is_wrong;
  closed("estimator killed", killed("estimator"), never, nothing, {"heartbeat-lost"}, holding,
         new_run);
  closed("estimator: endless loop in a handler", stopped("estimator"), continued("estimator"),
         nothing, {"heartbeat-lost"}, holding, by_itself);
  closed(
      "estimator: endless loop in its worker", [](World& world) { world.stop_work("estimator"); },
      [](World& world) { world.go_on_with_work("estimator"); }, nothing, {"node-fault"}, holding,
      by_itself)
      ->contradicts = [](World& world) { return world.in_fault("estimator"); };
  closed("LIDAR driver killed", killed("lidar-driver"), never, nothing, {"heartbeat-lost"}, holding,
         new_run);
  open("arm driver killed", killed("arm-driver-replica"), never, nothing,
       {"heartbeat-lost", "arm-silent"}, holding, new_run);
  open("facility driver killed", killed("facility-driver"), never, nothing, {"heartbeat-lost"},
       holding, new_run);
  open("testbed controller killed", killed("testbed"), never, nothing, {"setpoints-stale"},
       testbed_state_t::MOVING, new_run);
  open("testbed controller: endless loop in a handler", stopped("testbed"), continued("testbed"),
       resume, {"setpoints-stale"}, testbed_state_t::MOVING, by_resume);
  return list;
}

}  // namespace

const std::vector<Drill>& drills() {
  static const std::vector<Drill> list = all();
  return list;
}

}  // namespace berth::drills
