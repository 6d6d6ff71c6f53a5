// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/scan_request_t.hpp>
#include <optional>
#include <string>

#include "app/console/view/cell_status.h"
#include "app/console/view/section.h"
#include "lcmtypes/scan_packet.h"

namespace berth::console {

/// The section `scan` and the list `returns`: windows and returns of the scan that runs, or ran
/// last.
class ScanSection {
 public:
  void take(const logs::LogEvent& event);
  /// Writes what changed since the last time.
  void publish(const CellMessages& latest, Sink& sink);

 private:
  void begin(std::int64_t scan_id);
  std::string json(const CellMessages& latest) const;

  std::optional<scan_request_t> request_;  // of this scan, or of one that has not begun
  std::int64_t scan_id_ = 0;
  std::int8_t status_ = ScanPacket::COMPLETE;
  std::string reason_;
  std::int64_t beams_ = 0;
  std::int64_t hits_ = 0;
  std::string new_returns_;  // "x,y,z,x,y,z"
  bool is_new_ = false;
  bool changed_ = false;
};

}  // namespace berth::console
