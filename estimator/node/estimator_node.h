// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "common/bus/node.h"
#include "common/core/run_setup.h"
#include "estimator/node/estimator.h"

namespace berth {

/// Joins the estimator to the bus: SCAN_DATA, ESTIMATOR_COMMAND and INERTIAL_MOTION in;
/// SCAN_REQUEST, POSE_ESTIMATE, ESTIMATOR_STATE and ESTIMATOR_DIAGNOSTICS (with latency_us) out.
/// ESTIMATOR_STATE is also repeated at 1 Hz, for those that join late.
class EstimatorNode final : public Node, private estimator::EstimatorOutput {
 public:
  EstimatorNode(NodeSetup setup, estimator::EstimatorSetup estimator, Bus& bus, Loop& loop);
  ~EstimatorNode() override;

 private:
  void request(const scan_request_t& message) override;
  void estimate(const pose_estimate_t& message) override;
  void state(const estimator_state_t& message) override;
  void diagnostics(const estimator_diagnostics_t& message) override;
  void note(std::int8_t severity, const std::string& code, const std::string& text) override;

  /// One of another session (yesterday's log) is told once, and not obeyed.
  bool is_ours(const estimator_command_t& command);

  estimator::Estimator estimator_;
  std::int64_t foreign_session_ = 0;  // that was told last
  std::optional<Utime> latency_;  // of the last estimate, from its last return to its publication
  std::int64_t estimates_ok_ = 0;
  std::int64_t estimates_not_ok_ = 0;
  Loop::TimerId repeat_timer_ = 0;
};

/// From config/estimator.yaml and the LIDAR's file; compiles the run's target or takes it from the
/// cache. @throws InputError.
std::unique_ptr<Node> make_estimator_node(NodeSetup setup, const RunSetup& run, Bus& bus,
                                          Loop& loop);

}  // namespace berth
