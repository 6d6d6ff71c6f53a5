// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/doctor/finding.h"
#include "app/doctor/polled_registers.h"
#include "common/bus/loop.h"
#include "common/core/lidar_profile.h"
#include "common/core/run_setup.h"
#include "drivers/devices.h"
#include "drivers/facility/plc_map.h"
#include "drivers/lidar/adapter.h"

namespace berth {

/// The facility's PLC, read as its driver reads it, and never written to.
class PlcExamination {
 public:
  PlcExamination(const PlcDevice& device, const PlcMap& map, Loop& loop);

  std::vector<Finding> findings() const;

 private:
  void on_status(const RegisterAnswer& answer);
  Finding connection() const;
  Finding chain() const;

  PlcMap map_;
  std::vector<Word> words_;  // of the newest read
  int beats_ = 0;
  PolledRegisters plc_;
};

/// The LIDAR: its identity, and its clock. Nothing is scanned. A new connection takes the place of
/// the old one: a LIDAR that a run uses is left alone.
class LidarExamination {
 public:
  /// used_by: the run whose driver is connected to it; empty: none.
  LidarExamination(LidarDevice device, LidarProfile profile, std::string used_by, Loop& loop);

  std::vector<Finding> findings(Utime span) const;

 private:
  Finding identity() const;

  LidarDevice device_;
  LidarProfile profile_;
  std::string used_by_;
  std::unique_ptr<lidar::Adapter> adapter_;
};

/// Both arms' controllers, the PLC and the LIDAR of a configuration, at its addresses, for this
/// span. Registers are read and never written; the LIDAR is greeted and its clock requested.
/// @throws InputError for a configuration that is wrong.
std::vector<Finding> examine_hardware(const RunSetup& setup, Utime span);

}  // namespace berth
