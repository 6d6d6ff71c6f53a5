// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/bus/loop.h"

namespace berth {

/// What can go wrong with the simulated devices, and what does at present. No bus, no timer: the
/// cell asks it at the times that matter.
class FaultTable {
 public:
  /// What a fault's value means.
  enum class Value {
    none,   ///< it is there or not
    share,  ///< 0..1
    number,
    length,  ///< m
    angle,   ///< rad or m, per joint
    rate,    ///< rad/s or m/s, per joint
    time     ///< s
  };
  struct Fault {
    std::string device;
    std::string name;
    Value value = Value::none;
    double least = 0;
    double greatest = 0;
    std::function<void(double)> begin;
    std::function<void()> end;  ///< empty: over as soon as it has begun, as a dropped connection
  };

  void add(Fault fault) { faults_.push_back(std::move(fault)); }

  /// A fault that is there already takes the new value and duration.
  /// @param duration from now until it clears itself, s; 0: until it is cleared.
  /// @return why not, naming what is known; empty: done.
  std::string inject(const std::string& device, const std::string& name, double value,
                     double duration, Utime now);
  /// An empty name: all faults of the device. @return as above; that none is there is no mistake.
  std::string clear(const std::string& device, const std::string& name);
  void clear_all();
  /// Clears what has lasted its duration. @return whether anything has changed.
  bool advance(Utime now);
  /// When that is to be called again; 0: never.
  Utime next_change() const;

  /// "lidar: range_bias 50 mm", in the order of the table.
  std::vector<std::string> active() const;

 private:
  struct Active {
    double value = 0;
    Utime until = 0;  // 0: until it is cleared
  };

  std::string find(const std::string& device, const std::string& name, std::size_t& index) const;
  void end(std::size_t index);

  std::vector<Fault> faults_;
  std::map<std::size_t, Active> active_;
};

}  // namespace berth
