// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/estimator_state_t.hpp>
#include <optional>
#include <string>

#include "procedures/engine/actions.h"

namespace berth::procedures {

/// Commands to the estimator. One that came too late for its first scan is sent anew.
class EstimatorLink {
 public:
  EstimatorLink(Actions& actions, Commander commander);

  void command(estimator_command_t command, Utime now);
  Answer answer() const { return answer_; }
  const std::string& refusal() const { return refusal_; }
  std::int64_t seq() const { return command_.seq; }
  std::int64_t first_scan_id() const { return command_.first_scan_id; }

  void on(const estimator_state_t& state, Utime now);
  void tick(Utime now);
  const std::optional<estimator_state_t>& state() const { return state_; }

 private:
  void send_anew(Utime now);

  Actions& actions_;
  Commander commander_;
  std::int64_t last_seq_;
  estimator_command_t command_{};
  int attempts_ = 0;
  Utime sent_ = 0;
  Answer answer_ = Answer::none;
  std::string refusal_;
  std::optional<estimator_state_t> state_;
};

}  // namespace berth::procedures
