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
  CommandStatus status() const { return client_.status(); }
  const std::string& refusal() const { return client_.reason(); }
  std::int64_t seq() const { return client_.command().seq; }
  std::int64_t first_scan_id() const { return client_.command().first_scan_id; }

  void on(const estimator_state_t& state, Utime now);
  void tick(Utime now) { client_.tick(now); }
  const std::optional<estimator_state_t>& state() const { return state_; }

 private:
  /// For the first scan that it can still change.
  void send(estimator_command_t command, Utime now);

  Commander commander_;
  CommandClient<estimator_command_t> client_;
  int attempts_ = 0;
  std::optional<estimator_state_t> state_;
};

}  // namespace berth::procedures
