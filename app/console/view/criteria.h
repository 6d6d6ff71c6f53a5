// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/criterion_result_t.hpp>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/measure/criterion.h"
#include "logs/file/log_event.h"

namespace berth::console {

/// The criteria of the procedure that runs, measured again and again while it runs. Values until
/// the end are of thinned truth; the engine's own verdict replaces them.
class Criteria {
 public:
  /// nearest: on the target, for measurements that need its surface.
  explicit Criteria(evaluation::NearestPoint nearest);

  void take(const logs::LogEvent& event);
  /// As of now: pending, with the value so far, until their phase is over. Empty while no procedure
  /// is known.
  std::vector<criterion_result_t> so_far() const;

 private:
  void begin(const run_info_t& info);

  evaluation::NearestPoint nearest_;
  std::vector<evaluation::Criterion> criteria_;
  evaluation::RunRecord record_;
  bool judges_returns_ = false;  // a criterion rests on SCAN_DATA
  std::int64_t session_ = 0;
  Utime last_truth_ = 0;
};

/// Whether nothing more comes in the phase of a criterion.
bool is_over(const std::string& phase, const procedure_state_t& state);

/// The results as they were known when the procedure was in this state: those of phases that were
/// not over yet are pending and have no value.
std::vector<criterion_result_t> as_of(std::vector<criterion_result_t> results,
                                      const procedure_state_t& state);

}  // namespace berth::console
