// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "common/bus/node.h"
#include "common/core/run_setup.h"
#include "estimator/node/estimator.h"

namespace berth {

/// Connects the estimator to the bus: SCAN_DATA, ESTIMATOR_COMMAND and INERTIAL_MOTION in;
/// SCAN_REQUEST, POSE_ESTIMATE, ESTIMATOR_STATE and ESTIMATOR_DIAGNOSTICS (with latency_us) out.
/// ESTIMATOR_STATE is repeated at 1 Hz for late subscribers. The estimator runs on the node's
/// worker, input by input; its output is published on the loop when an input is done. Time budgets:
/// EstimatorOptions::budgets.
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

  /// Processes one input on the worker. budget: us; 0: that of the mode.
  void process(std::string name, std::function<void()> input, std::int64_t budget = 0);
  void publish(const pose_estimate_t& message);
  void publish(const estimator_state_t& message);
  void publish(estimator_diagnostics_t message);
  /// A command of another session (of a replayed log) is reported once and ignored.
  bool is_ours(const estimator_command_t& command);

  const estimator::Budgets budgets_;
  std::vector<std::function<void()>> output_;  // of the input under way, to be published
  estimator::Estimator estimator_;
  estimator_state_t state_{};         // last published
  std::int64_t foreign_session_ = 0;  // reported last
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
