// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/ground_truth_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/core/quantity.h"
#include "evaluation/measure/measurer.h"
#include "lcmtypes/latest_messages.h"

namespace berth::procedures {

/// The latest messages while a procedure runs, with the history that live quantities need.
class RunMessages : public LatestMessages {
 public:
  explicit RunMessages(evaluation::NearestPoint nearest) : nearest_(std::move(nearest)) {}

  using LatestMessages::on;
  void on(const run_info_t& message) { error_.on(message); }
  void on(const pose_estimate_t& message, Utime now);
  void on(const pose_estimate_t& message) = delete;  // its time counts
  void on(const ground_truth_t& message) { error_.on(message); }

  void set_time(Utime now) { now_ = now; }
  void begin_run(Utime now) { run_start_ = now; }
  void begin_phase(Utime now);
  void begin_step(Utime now) { step_start_ = now; }

  Utime now() const { return now_; }
  Utime run_start() const { return run_start_; }      ///< of the first step; 0: not yet
  Utime phase_start() const { return phase_start_; }  ///< begin of the present phase
  Utime step_start() const { return step_start_; }

  /// When a good estimate was last received; 0: never.
  Utime last_good_estimate() const { return last_good_; }
  /// Received since the phase began.
  int good_estimates() const { return good_estimates_; }
  /// The newest truth, unless it is old.
  std::optional<evaluation::TruthSample> truth() const;
  /// Error of the newest good estimate with truth at its time: [m; rad]; nothing when it is old.
  std::optional<Vector6d> error() const;
  /// From the sensor to the target's nearest surface, by truth; nothing without truth or mesh.
  std::optional<double> surface_range() const;

 private:
  /// Older values count as unknown.
  static constexpr Utime lifetime = 5 * second;

  evaluation::NearestPoint nearest_;
  Utime now_ = 0;
  Utime run_start_ = 0;
  Utime phase_start_ = 0;
  Utime step_start_ = 0;
  Utime last_good_ = 0;
  int good_estimates_ = 0;
  evaluation::LiveError error_;
};

/// A named quantity that can be read at any time while a procedure runs: for conditions, limits and
/// records.
struct LiveQuantity {
  std::string name;
  Dimension dimension;
  std::string unit;  ///< in which it is shown
  double unit_si;    ///< size of that unit
  std::string description;
  double (*value)(
      const RunMessages& live);         ///< SI; of a state the index of its word; NaN: not known
  std::vector<std::string> words = {};  ///< of a state; empty for a quantity

  bool is_state() const { return !words.empty(); }
  /// "3.201 m", "ok" or "not known".
  std::string text(double si) const;
};

const std::vector<LiveQuantity>& live_quantities();
/// nullptr when there is none of this name.
const LiveQuantity* live_quantity_named(const std::string& name);
/// "found 'x', expected one of: ...", with all names.
std::string unknown_live_quantity(const std::string& name);

}  // namespace berth::procedures
