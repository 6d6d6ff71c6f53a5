// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/bus/loop.h"

namespace berth::console {

/// Takes what a view has to show: the sections of PROTOCOL.md by their names, as JSON texts.
class Sink {
 public:
  virtual ~Sink() = default;

  /// The time of what comes next: in the cell, or of a replay in its log.
  virtual void at(Utime utime) = 0;
  /// Replaces a section.
  virtual void set(const std::string& section, std::string json) = 0;
  /// Appends to a list: an entry, or several with commas between them.
  virtual void add(const std::string& list, std::string json) = 0;
  /// Empties a list.
  virtual void reset(const std::string& list) = 0;
};

}  // namespace berth::console
