// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "app/finding.h"
#include "app/hardware/polled_registers.h"
#include "drivers/devices.h"
#include "drivers/facility/plc_map.h"

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

}  // namespace berth
