// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/procedure_node.h"

#include <algorithm>

#include "common/core/valid_text.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr Utime control_period = 500 * millisecond;
/// The state is repeated for late subscribers, as often as control; a large state more rarely, to
/// bound the growth of the log, bytes per second; with a maximum period.
constexpr double repeated_bytes = 10e3;
constexpr Utime max_repeat = 2 * second;
constexpr int final_repeats = 3;

procedures::EngineOptions options_of(const NodeSetup& setup, const ProcedureRun& run, Utime now) {
  procedures::EngineOptions options;
  // A later procedure of the session continues the numbers of an earlier one.
  options.commander = {setup.name, setup.session, now};
  options.required_nodes = run.required_nodes;
  options.supervisor = run.supervisor;
  options.outside = run.outside;
  if (!run.disk.empty()) {
    options.more_preconditions = [disk = run.disk] {
      return std::vector{procedures::room_on_disk(disk)};
    };
  }
  options.ready_timeout = run.ready_timeout;
  options.heartbeat_timeout = run.heartbeat_timeout;
  options.attended = run.attended;
  return options;
}

}  // namespace

ProcedureNode::ProcedureNode(const NodeSetup& node_setup, procedures::Procedure procedure,
                             const ProcedureRun& run, run_info_t info,
                             evaluation::NearestPoint nearest, Bus& the_bus, Loop& the_loop)
    : Node(node_setup, the_bus, the_loop),
      engine_(std::move(procedure), options_of(node_setup, run, the_loop.now()), std::move(nearest),
              *this),
      info_(std::move(info)),
      answers_(the_bus, the_loop, channels::procedure_answers, session()) {
  listen<testbed_state_t>(channels::testbed_state, 1000);
  listen<estimator_state_t>(channels::estimator_state, 1000);
  listen<facility_state_t>(channels::facility_state, 1000);
  listen<command_answers_t>(channels::facility_answers, 100);
  listen<lidar_state_t>(channels::lidar_state, 1000);
  listen<pose_estimate_t>(channels::pose_estimate, 1000);
  listen<injection_state_t>(channels::injection_state, 100);
  // Of any session: a stop is obeyed from any sender.
  bus().subscribe<procedure_command_t>(
      channels::procedure_command, Queue::fifo(100), [this](procedure_command_t message) {
        message.text.resize(first_columns(message.text, max_characters).size());
        take(message);
        after_input();
      });
  keep<ground_truth_t>(channels::ground_truth, 5000);
  keep<estimator_diagnostics_t>(channels::estimator_diagnostics, 5000);
  if (engine_.judges_returns()) keep<ScanPacket>(channels::scan_data, 5000);
  keep<setpoint_latency_t>(channels::setpoint_latency, 100);
  keep<injection_t>(channels::injection, 100);
  keep<event_t>(channels::event, 1000);
  bus().subscribe<node_status_t>(channels::node_status, Queue::fifo(1000),
                                 [this](const node_status_t& message) {
                                   if (message.session != session()) return;
                                   engine_.on(message, now());
                                   after_input();
                                 });
  bus().subscribe<heartbeat_t>(channels::heartbeat, Queue::fifo(1000),
                               [this](const heartbeat_t& message) {
                                 if (message.session == session()) engine_.on(message, now());
                               });
  timers_.push_back(loop().after(0, [this] { start(); }));
}

ProcedureNode::~ProcedureNode() {
  for (const Loop::TimerId timer : timers_) loop().cancel(timer);
}

template <class Message>
void ProcedureNode::listen(const char* channel, std::size_t capacity) {
  bus().subscribe<Message>(channel, Queue::fifo(capacity), [this](const Message& message) {
    if (message.session != session()) return;
    engine_.on(message, now());
    after_input();
  });
}

template <class Message>
void ProcedureNode::keep(const char* channel, std::size_t capacity) {
  bus().subscribe<Message>(channel, Queue::fifo(capacity), [this](const Message& message) {
    if (message.session == session()) engine_.on(message);
  });
}

/// KEEP_CONTROL is not answered: OPERATOR_CONTROL contains the holder.
void ProcedureNode::take(const procedure_command_t& command) {
  if (command.command == procedure_command_t::KEEP_CONTROL) {
    engine_.obey(command, now());
    return;
  }
  if (!answers_.is_new(command)) return;
  const std::string refusal = engine_.obey(command, now());
  if (refusal.empty()) {
    answers_.accept(command);
  } else {
    answers_.refuse(command, refusal);
  }
}

void ProcedureNode::start() {
  engine_.start(now());
  publish_info();
  publish_state();
  timers_.push_back(loop().every(50 * millisecond, [this] {
    engine_.tick(now());
    after_input();
    if (now() - last_published_ >= repeat_after_) publish_state();
    if (now() - last_control_ >= control_period) publish_control();
  }));
  timers_.push_back(loop().every(10 * second, [this] { publish_info(); }));
}

void ProcedureNode::after_input() {
  if (engine_.revision() != published_revision_) publish_state();
}

void ProcedureNode::publish_info() {
  info_.utime = now();
  ++info_.seq;
  engine_.on(info_);
  bus().publish(channels::run_info, info_);
}

void ProcedureNode::publish_state() {
  published_ = engine_.snapshot(now());
  published_revision_ = engine_.revision();
  last_published_ = now();
  bus().publish(channels::procedure_state, published_);
  publish_control();
  if (!engine_.finished()) {
    report(node_status_t::RUNNING);
    const double seconds = published_.getEncodedSize() / repeated_bytes;
    repeat_after_ = std::clamp(utime_from_seconds(seconds), control_period, max_repeat);
    return;
  }
  repeat_after_ = control_period;
  ++final_repeats_;
  // Announces the silence that follows.
  report(final_repeats_ >= final_repeats ? node_status_t::STOPPED : node_status_t::READY);
  if (final_repeats_ == final_repeats && finished_) finished_();
}

void ProcedureNode::publish_control() {
  last_control_ = now();
  bus().publish(channels::operator_control, engine_.control(now()));
}

void ProcedureNode::send(const testbed_command2_t& command) {
  bus().publish(channels::testbed_command, command);
  engine_.on(command);
}
void ProcedureNode::send(const estimator_command_t& command) {
  bus().publish(channels::estimator_command, command);
}
void ProcedureNode::send(const facility_command_t& command) {
  bus().publish(channels::facility_command, command);
}
void ProcedureNode::send(const injection_t& injection) {
  bus().publish(channels::injection, injection);
}
void ProcedureNode::send(const verdict_basis_t& basis) {
  bus().publish(channels::verdict_basis, basis);
}
void ProcedureNode::event(std::int8_t severity, const std::string& code, const std::string& text) {
  Node::event(severity, code, text);
}

std::unique_ptr<ProcedureNode> make_procedure_node(const NodeSetup& setup,
                                                   const RunSetup& run_setup,
                                                   const ProcedureRun& run, Bus& bus, Loop& loop) {
  procedures::Procedure procedure = procedures::load_procedure(run.file, run.parameters);
  const Target target = load_target(run_setup.target, run_setup.target_length);
  run_info_t info = procedures::make_run_info(procedure, run_setup, target, run.name, run.host,
                                              setup.configuration_hash);
  info.session = setup.session;
  info.attachments.insert(info.attachments.end(), run.attachments.begin(), run.attachments.end());
  info.attachment_count = static_cast<std::int32_t>(info.attachments.size());
  return std::make_unique<ProcedureNode>(setup, std::move(procedure), run, std::move(info),
                                         evaluation::nearest_point_on(target), bus, loop);
}

}  // namespace berth
