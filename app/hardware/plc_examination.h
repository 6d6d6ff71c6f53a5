// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/finding.h"
#include "app/hardware/round_trips.h"
#include "drivers/devices.h"
#include "drivers/facility/plc_map.h"
#include "drivers/registers/register_link.h"

namespace berth {

/// The facility's PLC, read as its driver reads it, and never written to.
class PlcExamination {
 public:
  PlcExamination(PlcDevice device, const PlcMap& map, Loop& loop);
  ~PlcExamination();
  PlcExamination(const PlcExamination&) = delete;
  PlcExamination& operator=(const PlcExamination&) = delete;

  std::vector<Finding> findings() const;

 private:
  void poll();
  Finding connection() const;
  Finding chain() const;

  PlcDevice device_;
  PlcMap map_;
  Loop& loop_;
  RoundTrips round_trips_;
  std::string unreachable_;
  bool connected_ = false;
  bool under_way_ = false;
  std::vector<Word> words_;
  int beats_ = 0;
  std::unique_ptr<RegisterLink> link_;
  Loop::TimerId timer_;
};

}  // namespace berth
