// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/node/estimator_node.h"

#include "estimator/plan/operating_range.h"
#include "lcmtypes/channels.h"

namespace berth {

EstimatorNode::EstimatorNode(NodeSetup setup, estimator::EstimatorSetup estimator, Bus& the_bus,
                             Loop& the_loop)
    : Node(std::move(setup), the_bus, the_loop),
      budgets_(estimator.options.budgets),
      estimator_(std::move(estimator), *this) {
  bus().subscribe<ScanPacket>(channels::scan_data, Queue::fifo(4000),
                              [this](const ScanPacket& packet) {
                                if (packet.session != session()) return;
                                process("scan " + std::to_string(packet.scan_id),
                                        [this, packet] { estimator_.receive(packet); });
                              });
  bus().subscribe<estimator_command_t>(
      channels::estimator_command, Queue::fifo(), [this](const estimator_command_t& command) {
        if (!is_ours(command)) return;
        const bool model = command.command == estimator_command_t::CHOOSE_MODEL;
        process(
            "command " + std::to_string(command.seq),
            [this, command] { estimator_.receive(command); }, model ? budgets_.model : 0);
      });
  bus().subscribe<inertial_motion_t>(
      channels::inertial_motion, Queue::fifo(), [this](const inertial_motion_t& motion) {
        if (motion.session != session()) return;
        process("inertial motion", [this, motion] { estimator_.receive(motion); });
      });
  process("the first state", [this] { estimator_.publish_state(); });
  repeat_timer_ =
      loop().every(second, [this] { bus().publish(channels::estimator_state, state_); });
}

EstimatorNode::~EstimatorNode() {
  end_work();
  loop().cancel(repeat_timer_);
}

void EstimatorNode::process(std::string name, std::function<void()> input, std::int64_t budget) {
  const bool tracks = state_.mode == estimator_state_t::TRACKING;
  if (budget == 0) budget = tracks ? budgets_.track : budgets_.acquire;
  const auto output = std::make_shared<std::vector<std::function<void()>>>();
  work({std::move(name), budget,
        [this, input = std::move(input), output] {
          input();
          output->swap(output_);
        },
        [output] {
          for (const auto& publish : *output) publish();
        }});
}

bool EstimatorNode::is_ours(const estimator_command_t& command) {
  if (command.session == session()) return true;
  if (command.session != foreign_session_) {
    event(event_t::WARNING, "command-of-another-session",
          "a command of '" + command.commander + "' belongs to session " +
              std::to_string(command.session) + " and changes no estimate");
  }
  foreign_session_ = command.session;
  return false;
}

// The estimator's output, on the worker.

void EstimatorNode::request(const scan_request_t& message) {
  output_.emplace_back([this, message] { bus().publish(channels::scan_request, message); });
}

void EstimatorNode::estimate(const pose_estimate_t& message) {
  output_.emplace_back([this, message] { publish(message); });
}

void EstimatorNode::state(const estimator_state_t& message) {
  output_.emplace_back([this, message] { publish(message); });
}

void EstimatorNode::diagnostics(const estimator_diagnostics_t& message) {
  output_.emplace_back([this, message] { publish(message); });
}

void EstimatorNode::note(std::int8_t severity, const std::string& code, const std::string& text) {
  output_.emplace_back([this, severity, code, text] { event(severity, code, text); });
}

// Its publication, on the loop.

void EstimatorNode::publish(const pose_estimate_t& message) {
  (message.status == pose_estimate_t::OK ? estimates_ok_ : estimates_not_ok_) += 1;
  count("estimates_ok", static_cast<double>(estimates_ok_));
  count("estimates_not_ok", static_cast<double>(estimates_not_ok_));
  bus().publish(channels::pose_estimate, message);
  latency_.reset();
  if (message.utime_last_return != 0) {
    latency_ = now() + setup().compute_delay - message.utime_last_return;
  }
}

void EstimatorNode::publish(const estimator_state_t& message) {
  state_ = message;
  bus().publish(channels::estimator_state, message);
  switch (message.mode) {
    case estimator_state_t::IDLE:
      report(node_status_t::READY);
      break;
    case estimator_state_t::LOST:
      report(node_status_t::DEGRADED, message.reason);
      break;
    default:
      report(node_status_t::RUNNING);
  }
}

void EstimatorNode::publish(estimator_diagnostics_t message) {
  if (latency_) {
    message.names.emplace_back("latency_us");
    message.values.push_back(static_cast<double>(*latency_));
  }
  message.value_count = static_cast<std::int32_t>(message.names.size());
  bus().publish(channels::estimator_diagnostics, message);
}

std::unique_ptr<Node> make_estimator_node(NodeSetup setup, const RunSetup& run, Bus& bus,
                                          Loop& loop) {
  estimator::EstimatorSetup estimator;
  estimator.options = estimator::load_estimator_options(run.config / "estimator.yaml");
  estimator.lidar = load_lidar_profile(run, estimator.options.lidar);
  estimator.target = run.target;
  estimator.session = setup.session;
  estimator.find_model = [length = run.target_length,
                          options = estimator.options](const std::string& name) {
    const Target target = load_target(name, length);
    estimator::require_port(target, options.ranges);
    return estimator::load_target_model(target, options.model,
                                        estimator::default_cache_directory());
  };
  estimator.stopwatch = [&loop] { return loop.stopwatch(); };
  return std::make_unique<EstimatorNode>(std::move(setup), std::move(estimator), bus, loop);
}

}  // namespace berth
