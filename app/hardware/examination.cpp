// SPDX-License-Identifier: BSD-3-Clause
#include "app/hardware/examination.h"

#include "app/hardware/arm_examination.h"
#include "app/hardware/lidar_examination.h"
#include "app/hardware/plc_examination.h"
#include "app/runs/active_runs.h"
#include "app/runs/run_files.h"
#include "common/bus/process_loop.h"
#include "common/core/config.h"

namespace berth {

namespace {

/// The run of this user whose configuration has the LIDAR's address; empty: none.
std::string user_of(const LidarDevice& lidar) {
  for (const ActiveRun& run : active_runs()) {
    const RunFiles files = RunFiles::open(run.directory);
    if (load_devices(files.setup.config).lidar.address == lidar.address) {
      return run.directory.string();
    }
  }
  return "";
}

}  // namespace

std::vector<Finding> examine_hardware(const RunSetup& setup, Utime span) {
  const Devices devices = load_devices(setup.config);
  const auto map_file = [&](const std::string& name) {
    return setup.config / "registers" / (name + ".yaml");
  };
  ProcessLoop loop(clock_offset_now());
  const auto arm = [&](ArmRole role) {
    const ArmDevice& device = devices.arm(role);
    Config layout = Config::load(setup.layout_file());
    return std::make_unique<ArmExamination>(
        ArmExamination::Setup{
            role, device, RegisterMap::load(map_file(device.registers)),
            ArmKinematics::load(setup.config / layout.section(name_of(role)).text("arm"))},
        loop);
  };
  const auto replica = arm(ArmRole::replica);
  const auto sensor = arm(ArmRole::sensor);
  PlcExamination plc(devices.plc, PlcMap::load(map_file(devices.plc.registers)), loop);
  LidarExamination lidar(devices.lidar, load_lidar_profile(setup, devices.lidar.model),
                         user_of(devices.lidar), loop);
  loop.after(span, [&] { loop.stop(); });
  loop.run();

  std::vector<Finding> list = replica->findings(span);
  for (const auto& more : {sensor->findings(span), plc.findings(), lidar.findings(span)}) {
    list.insert(list.end(), more.begin(), more.end());
  }
  return list;
}

}  // namespace berth
