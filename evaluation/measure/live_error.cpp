// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/live_error.h"

namespace berth::evaluation {

void LiveError::on(const pose_estimate_t& message) {
  constexpr std::size_t max_waiting = 100;
  waiting_.push_back(sample_of(message));
  if (waiting_.size() > max_waiting) waiting_.pop_front();
}

void LiveError::on(const ground_truth_t& message) {
  truth_.add_live(sample_of(message));
  const Utime until = truth_.samples().back().utime;
  while (!waiting_.empty() && waiting_.front().utime <= until) {
    if (auto compared = compare(waiting_.front(), truth_, symmetry_)) latest_ = std::move(compared);
    waiting_.pop_front();
  }
}

}  // namespace berth::evaluation
