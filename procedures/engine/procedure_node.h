// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>

#include "common/bus/commands.h"
#include "common/bus/node.h"
#include "common/core/run_setup.h"
#include "procedures/engine/engine.h"
#include "procedures/engine/run_info.h"

namespace berth {

/// Setup of a procedure's run, in addition to RunSetup.
struct ProcedureRun {
  std::filesystem::path file;
  procedures::Overrides parameters;
  std::string name;                               ///< of the run
  std::int8_t host = run_info_t::SIMULATED_CELL;  ///< run_info_t::CELL ...
  /// Names of the nodes that must be ready before it starts and alive while it goes.
  std::vector<std::string> required_nodes = {"arm-driver-replica", "arm-driver-sensor",
                                             "lidar-driver",       "facility-driver",
                                             "estimator",          "testbed"};
  std::string supervisor;                      ///< as EngineOptions::supervisor
  std::map<std::string, std::string> outside;  ///< as EngineOptions::outside
  std::vector<attachment_t> attachments;  ///< of RUN_INFO, in addition to those of make_run_info()
  /// Folder of the log, whose disk must have room; empty: not checked.
  std::filesystem::path disk;
  Utime ready_timeout = 120 * second;
  Utime heartbeat_timeout = second;
  bool attended = true;  ///< as EngineOptions::attended
};

/// The engine on the bus. Publishes PROCEDURE_STATE and OPERATOR_CONTROL on change and at 2 Hz,
/// RUN_INFO at the start and every 10 s; answers PROCEDURE_COMMAND by PROCEDURE_ANSWERS.
class ProcedureNode final : public Node, private procedures::Actions {
 public:
  ProcedureNode(const NodeSetup& setup, procedures::Procedure procedure, const ProcedureRun& run,
                run_info_t info, evaluation::NearestPoint nearest, Bus& bus, Loop& loop);
  ~ProcedureNode() override;

  /// Called once, some time after the final state was first published and has been repeated.
  void when_finished(std::function<void()> callback) { finished_ = std::move(callback); }
  bool finished() const { return engine_.finished(); }
  /// The final state, or the latest.
  const procedure_state_t& state() const { return published_; }
  /// 0 pass, 1 fail, 2 error or time-out, 3 aborted, 4 inconclusive.
  int exit_code() const { return evaluation::exit_code_of_outcome(published_.outcome); }

 private:
  void send(const testbed_command2_t& command) override;
  void send(const estimator_command_t& command) override;
  void send(const facility_command_t& command) override;
  void send(const injection_t& injection) override;
  void send(const verdict_basis_t& basis) override;
  void event(std::int8_t severity, const std::string& code, const std::string& text) override;

  template <class Message>
  void listen(const char* channel, std::size_t capacity);
  /// Subscribes to messages that only the verdict needs.
  template <class Message>
  void keep(const char* channel, std::size_t capacity);
  void take(const procedure_command_t& command);
  void start();
  void after_input();
  void publish_state();
  void publish_control();
  void publish_info();

  procedures::Engine engine_;
  run_info_t info_;
  procedure_state_t published_{};
  int published_revision_ = -1;
  Utime last_published_ = 0;
  Utime repeat_after_ = 0;
  Utime last_control_ = 0;
  int final_repeats_ = 0;
  CommandAnswers answers_;
  std::vector<Loop::TimerId> timers_;
  std::function<void()> finished_;
};

/// @throws InputError for a procedure, parameter, target or configuration that is wrong.
std::unique_ptr<ProcedureNode> make_procedure_node(const NodeSetup& setup,
                                                   const RunSetup& run_setup,
                                                   const ProcedureRun& run, Bus& bus, Loop& loop);

}  // namespace berth
