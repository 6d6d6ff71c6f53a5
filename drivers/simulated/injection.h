// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/core/fault_kind.h"
#include "drivers/simulated/cell_scene.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "drivers/simulated/simulated_controller.h"
#include "drivers/simulated/simulated_plc.h"

namespace berth {

/// The possible faults of the simulated devices, and the active ones. Without bus and timer: the
/// cell calls it when a fault is due.
class FaultTable {
 public:
  /// Sets the actions at the begin of a fault of fault_kinds(), with its value, and at its end; a
  /// fault without an end is instantaneous, such as a dropped connection.
  void set(const std::string& device, const std::string& name, std::function<void(double)> begin,
           std::function<void()> end);
  /// @return kinds for which nothing was set.
  std::vector<std::string> unset() const;

  /// A fault that is there already takes the new value and duration.
  /// @param duration from now until it clears itself, s; 0: until it is cleared.
  /// @return why it was refused, with the known names; empty: done.
  std::string inject(const std::string& device, const std::string& name, double value,
                     double duration, Utime now);
  /// An empty name: all faults of the device. @return as above; clearing an inactive fault is no
  /// error.
  std::string clear(const std::string& device, const std::string& name);
  void clear_all();
  /// Clears faults whose duration is over. @return whether anything has changed.
  bool advance(Utime now);
  /// When advance() is due again; 0: never.
  Utime next_change() const;

  /// "lidar: range_bias 50 mm", in the order of the table.
  std::vector<std::string> active() const;

 private:
  struct Active {
    double value = 0;
    Utime until = 0;  // 0: until it is cleared
  };

  struct Effect {
    std::function<void(double)> begin;
    std::function<void()> end;
  };

  void end(std::size_t index);

  std::vector<Effect> effects_ = std::vector<Effect>(fault_kinds().size());
  std::map<std::size_t, Active> active_;
};

/// All faults of the simulated cell: docs/simulated_cell.md has the table. The devices must outlive
/// it.
FaultTable cell_faults(SimulatedController& replica, SimulatedController& sensor, SimulatedPlc& plc,
                       SimulatedLidar& lidar, CellScene& scene);

}  // namespace berth
