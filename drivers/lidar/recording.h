// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "drivers/lidar/protocol.h"

namespace berth::lidar {

struct RecordedBeam {
  Utime utime = 0;  ///< of the recording
  std::uint16_t window = 0;
  BeamReturn beam;  ///< after_us is not used
};

struct RecordedScan {
  std::string name;                 ///< for messages
  std::vector<RecordedBeam> beams;  ///< in ascending time
  bool timed = false;               ///< times of two scans have to do with one another
  Utime delay = 0;                  ///< from the request to the first beam, when it was recorded
  std::string failure;              ///< why it ended early; empty: it is complete
};

/// Scans that somebody recorded, one by one.
class Recording {
 public:
  virtual ~Recording() = default;
  /// What is played: a path.
  virtual const std::string& name() const = 0;
  /// Nothing at the end. @throws InputError for a scan that cannot be read; the next call goes on
  /// after it.
  virtual std::optional<RecordedScan> next() = 0;
  virtual void rewind() = 0;
};

}  // namespace berth::lidar
