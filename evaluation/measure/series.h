// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "evaluation/measure/measurer.h"
#include "evaluation/measure/truth_join.h"

namespace berth::evaluation {

using OfEstimate = Uncertain (*)(const ComparedEstimate&);

/// Of every good estimate in the phase that truth brackets; values that are not finite are left
/// out.
Series estimate_series(OfEstimate value, const Measurer& measurer, const Phase& phase);

/// Of truth itself: the first sample in each tenth of a second, and the last of each stretch.
Series truth_series(const std::function<Uncertain(const TruthSample&)>& value,
                    const Measurer& measurer, const Phase& phase);

/// A family of measurements in the making.
class Family {
 public:
  Family(const char* name, std::vector<Measurement>& table) : name_(name), table_(table) {}

  void estimates(const char* name, berth::Dimension dimension, Direction direction,
                 OfEstimate value, const char* description);
  void series(const char* name, berth::Dimension dimension, Direction direction,
              std::function<Series(const Measurer&, const Phase&)> series, const char* description);
  void number(const char* name, berth::Dimension dimension, Direction direction,
              std::function<Measured(const Measurer&, const Phase&)> number,
              const char* description);
  /// What is added next is left out of tables for people.
  Family& detail();
  /// What is added last is a share, shown in per cent.
  void in_percent();
  void in_milliseconds();
  /// What is added last is taken from SCAN_DATA.
  void of_returns();
  /// Of what is added last the values nearest to this are best, not the smallest.
  void best_near(double (*ideal)(Statistic));

 private:
  void add(Measurement measurement);

  const char* name_;
  std::vector<Measurement>& table_;
  bool detail_ = false;
};

// One function per family, each in the file of its name.
void add_errors(std::vector<Measurement>& table);
void add_velocities(std::vector<Measurement>& table);
void add_consistency(std::vector<Measurement>& table);
void add_availability(std::vector<Measurement>& table);
void add_scans(std::vector<Measurement>& table);
void add_steps(std::vector<Measurement>& table);
void add_timing(std::vector<Measurement>& table);
void add_mount(std::vector<Measurement>& table);
void add_following(std::vector<Measurement>& table);
void add_approach(std::vector<Measurement>& table);
void add_safety(std::vector<Measurement>& table);

}  // namespace berth::evaluation
