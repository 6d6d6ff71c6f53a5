// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/monitor.h"

#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>

#include "app/console/serving.h"
#include "app/exit_code.h"
#include "app/runs/run_files.h"
#include "app/runs/run_list.h"
#include "app/terminal/operator_keys.h"
#include "app/terminal/procedure_client.h"
#include "app/terminal/raw_terminal.h"
#include "app/terminal/terminal_view.h"
#include "common/bus/lcm_bus.h"
#include "common/core/child_process.h"
#include "common/core/error.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

/// Asks the supervisor to stop: it aborts the procedure at the first, and kills at the second time.
void request_stop(const ProcessHandle& supervisor, int times) {
  if (times == 1) {
    std::printf("\naborting; once more stops everything at once\n");
  } else {
    std::printf("\nstopping everything\n");
  }
  supervisor.signal(SIGTERM);
}

int exit_code_of(const RunFiles& files, bool interrupted) {
  if (!files.has_procedure) return exit_code::passed;
  const auto outcome = recorded_outcome(files.directory);
  if (outcome && *outcome != procedure_state_t::NONE)
    return evaluation::exit_code_of_outcome(*outcome);
  return interrupted ? exit_code::aborted : exit_code::error;
}

/// One terminal on one run.
class Monitor {
 public:
  Monitor(const ActiveRun& run, const ProcessHandle& supervisor, const RunFiles& files,
          bool observing)
      : run_(run),
        supervisor_(supervisor),
        files_(files),
        loop_(clock_offset_now()),
        keys_([this](const procedure_command_t& command) { send(command); }, observing,
              client_.name()) {
    loop_.on_signals([this, observing](int) {
      if (observing) return leave();
      view_.clear_panel();
      request_stop(supervisor_, ++interrupts_);
    });
    show<procedure_state_t>(channels::procedure_state);
    show<run_info_t>(channels::run_info);
    show<pose_estimate_t>(channels::pose_estimate);
    show<ground_truth_t>(channels::ground_truth);
    show<testbed_state_t>(channels::testbed_state);
    show<operator_control_t>(channels::operator_control);
    show<event_t>(channels::event);
    if (files.has_procedure && raw_.active()) {
      loop_.watch(STDIN_FILENO, [this] { read_keys(); });
    }
    loop_.every(200 * millisecond, [this] { refresh(false); });
    loop_.every(500 * millisecond, [this] {
      if (keys_.has_control()) client_.keep_control();
    });
    look_for_console();
  }

  /// Until the supervisor ends or the operator leaves.
  void run() {
    loop_.watch(supervisor_.descriptor(), [this] {
      loop_.unwatch(supervisor_.descriptor());
      loop_.stop();
    });
    bus_.start();
    loop_.run();
    view_.clear_panel();
  }

  bool left() const { return left_; }
  int interrupts() const { return interrupts_; }

 private:
  template <class Message>
  void show(const char* channel) {
    bus_.subscribe<Message>(channel, Queue::fifo(), [this](const Message& message) {
      if (message.session != files_.setup.session) return;
      view_.on(message);
      if constexpr (requires { keys_.on(message); }) keys_.on(message);
    });
  }

  void send(const procedure_command_t& command) {
    client_.send(command, [this](CommandStatus status, const std::string& reason) {
      keys_.on_answer(status, reason);
      refresh(true);
    });
  }

  /// The console reports its address soon after the start.
  void look_for_console() {
    const auto address = console::console_address(files_.directory);
    if (!address) {
      if (++looks_for_console_ < max_looks) loop_.after(second / 5, [this] { look_for_console(); });
      return;
    }
    view_.clear_panel();
    std::printf("console %s\n", address->c_str());
    std::fflush(stdout);
  }

  void read_keys() {
    char typed[64];
    const ssize_t count = read(STDIN_FILENO, typed, sizeof typed);
    if (count <= 0) return loop_.unwatch(STDIN_FILENO);  // the terminal is gone
    // cursor keys and the like are sequences that begin with Escape: none of them means anything
    if (count > 1 && typed[0] == '\x1b') return;
    for (ssize_t i = 0; i < count; ++i) keys_.type(typed[i]);
    refresh(true);
    if (keys_.leaves()) leave();
  }

  void refresh(bool urgent) {
    view_.refresh(
        raw_.active() && files_.has_procedure ? keys_.lines() : std::vector<terminal::Line>{},
        urgent);
  }

  void leave() {
    left_ = true;
    if (!keys_.has_control()) return loop_.stop();
    procedure_command_t command{};
    command.command = procedure_command_t::RELEASE_CONTROL;
    client_.send(command, [this](CommandStatus, const std::string&) { loop_.stop(); });
  }

  const ActiveRun& run_;
  const ProcessHandle& supervisor_;
  const RunFiles& files_;
  ProcessLoop loop_;
  LcmBus bus_{run_.url, loop_};
  ProcedureClient client_{bus_, loop_, files_.setup.session};
  terminal::OperatorKeys keys_;  // named by the client: after it
  terminal::TerminalView view_;
  terminal::RawTerminal raw_;
  static constexpr int max_looks = 100;
  int looks_for_console_ = 0;
  int interrupts_ = 0;
  bool left_ = false;
};

}  // namespace

int monitor(const ActiveRun& run, bool observing, ChildProcess* own) {
  const RunFiles files = RunFiles::open(run.directory);
  const ProcessHandle supervisor(run.supervisor);
  int interrupts = 0;
  if (supervisor.descriptor() >= 0) {
    if (!files.has_procedure) {
      std::printf("the cell is up on %s; Ctrl-C brings it down\n", run.url.c_str());
      std::fflush(stdout);
    }
    Monitor monitor(run, supervisor, files, observing);
    monitor.run();
    if (monitor.left()) {
      std::printf("the run goes on; berth attach shows it again\n");
      return exit_code::passed;
    }
    interrupts = monitor.interrupts();
  }
  if (files.has_procedure) terminal::show_verdict(files);
  // It has judged the log, whether its results could be written or not.
  const auto end = own != nullptr ? own->wait_for(std::chrono::milliseconds(0)) : std::nullopt;
  if (files.has_procedure && end && end->signal == 0) return end->code();
  return exit_code_of(files, interrupts > 0);
}

}  // namespace berth
