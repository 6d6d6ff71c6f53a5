// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/supervisor.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <berth/event_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <cstdio>
#include <deque>

#include "app/exit_code.h"
#include "app/runs/active_runs.h"
#include "app/runs/own_estimator.h"
#include "app/runs/verdict.h"
#include "app/runs/watched_process.h"
#include "app/terminal/procedure_client.h"
#include "common/bus/lcm_bus.h"
#include "common/bus/node.h"
#include "common/core/valid_text.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr Utime time_to_stop = 5 * second;
constexpr Utime time_to_abort = 60 * second;
constexpr Utime time_to_console = second;  // from its end to another try
constexpr int console_tries = 5;

class Supervisor : public Node {
 public:
  Supervisor(const RunFiles& files, bool with_console, LcmBus& bus, ProcessLoop& loop)
      : Node({"supervisor", files.setup.session, files.configuration_hash}, bus, loop),
        files_(files),
        with_console_(with_console),
        loop_(loop),
        client_(bus, loop, files.setup.session, "supervisor") {}

  void start() {
    start_recorder();
    // The nodes' first words should be in the log: the recorder is given time to join the group.
    loop_.after(300 * millisecond, [this] { start_nodes(); });
  }

  void on_signal() {
    if (!aborting_ && procedure_ != nullptr && procedure_->running()) {
      aborting_ = true;
      event(event_t::WARNING, "abort", "stop requested of the supervisor: aborting the procedure");
      send_abort();
      loop_.after(time_to_abort, [this] { finish(exit_code::aborted); });
      return;
    }
    finish(procedure_ == nullptr ? exit_code::passed : exit_code::aborted);
  }

  int exit_code() const { return exit_code_; }

 private:
  void start_recorder() {
    recorder_ = launch("lcm-logger", "lcm-logger",
                       {"--quiet", "--lcm-url=" + bus_url(files_.url), files_.log().string()},
                       [this](const ProcessEnd& end) {
                         if (stage_ == Stage::stopped) return loop_.stop();
                         trouble("lcm-logger " + end.text() + ": nothing is recorded any more");
                       });
  }

  void start_nodes() {
    if (!files_.joins) start_cell();
    if (files_.has_procedure) {
      procedure_ =
          launch("procedure", program_directory() / "berth-procedure", run_arguments({}),
                 [this](const ProcessEnd& end) {
                   finish(end.code() <= exit_code::inconclusive ? end.code() : exit_code::error);
                 });
    }
    if (with_console_ && !files_.joins) start_console();
    report(node_status_t::RUNNING, "");
  }

  /// It only shows: the run goes on without it.
  void start_console() {
    ++console_starts_;
    try {
      launch("console", program_directory() / "berth-console", run_arguments({}),
             [this](const ProcessEnd& end) {
               if (stage_ != Stage::running) return children_ended();
               console_ended(end.text() + ": " + last_words("console"));
             });
    } catch (const std::exception& e) {
      console_ended(e.what());
    }
  }

  void console_ended(const std::string& how) {
    const bool again = console_starts_ < console_tries;
    event(event_t::WARNING, "console-ended",
          "the console " + how + (again ? "; it is started again" : "; it is not started again"));
    if (!again) return;
    loop_.after(time_to_console, [this] {
      if (stage_ == Stage::running) start_console();
    });
  }

  void start_cell() {
    const std::vector<std::string> real_time{"--real-time"};
    if (files_.host == "simulated-cell") {
      devices_ = node("simulated-cell", "berth-simulated-cell", real_time);
    }
    node("arm-driver-replica", "berth-arm-driver", {"--arm", "replica", "--real-time"});
    node("arm-driver-sensor", "berth-arm-driver", {"--arm", "sensor", "--real-time"});
    node("lidar-driver", "berth-lidar-driver", {});
    node("facility-driver", "berth-facility-driver", {});
    node("testbed", "berth-testbed", real_time);
    start_estimator();
  }

  void start_estimator() {
    if (files_.estimator == outside_estimator) return;
    // An absolute path stays one.
    node("estimator", files_.estimator.empty() ? "berth-estimator" : files_.estimator,
         {"--lcm-url", bus_url(files_.url)});
  }

  WatchedProcess* node(const std::string& name, const std::string& program,
                       const std::vector<std::string>& arguments) {
    return launch(name, program_directory() / program, run_arguments(arguments),
                  [this, name](const ProcessEnd& end) {
                    if (stage_ != Stage::running) return children_ended();
                    trouble(name + " " + end.text() + ": " + last_words(name));
                  });
  }

  std::vector<std::string> run_arguments(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"--run", files_.directory.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  WatchedProcess* launch(const std::string& name, const std::filesystem::path& program,
                         std::vector<std::string> arguments, WatchedProcess::Ended ended) {
    arguments.insert(arguments.begin(), program.string());
    children_.emplace_back(loop_, arguments, output_of(name), std::move(ended));
    return &children_.back();
  }

  /// The last line that a process printed.
  std::string last_words(const std::string& name) const {
    const std::string last = last_line(output_of(name));
    return last.empty() ? "its output is empty" : last;
  }

  std::filesystem::path output_of(const std::string& name) const {
    return files_.directory / "output" / (name + ".txt");
  }

  /// A process is gone that should not be. The procedure sees its silence and ends by itself, with
  /// its teardown; if it does not, or there is none, the supervisor ends.
  void trouble(const std::string& what) {
    print_text(what + "\n");
    event(event_t::ERROR, "process-ended", what);
    report(node_status_t::FAULT, what);
    if (troubled_) return;
    troubled_ = true;
    loop_.after(procedure_ == nullptr ? 0 : time_to_abort, [this] { finish(exit_code::error); });
  }

  void send_abort() {
    procedure_command_t command{};
    command.command = procedure_command_t::ABORT;
    command.text = "stopped by the operator";
    client_.send(std::move(command));
  }

  void finish(int code) {
    if (stage_ != Stage::running) return;
    stage_ = Stage::stopping;
    exit_code_ = code;
    // The devices last, so that no node reports their silence.
    for (auto& child : children_) {
      if (&child != recorder_ && &child != devices_) child.signal(SIGTERM);
    }
    if (devices_ != nullptr) {
      loop_.after(300 * millisecond, [this] { devices_->signal(SIGTERM); });
    }
    loop_.after(time_to_stop, [this] {
      for (auto& child : children_) {
        if (&child != recorder_) child.signal(SIGKILL);
      }
    });
    children_ended();
  }

  void children_ended() {
    const bool any =
        std::any_of(children_.begin(), children_.end(),
                    [this](const WatchedProcess& c) { return &c != recorder_ && c.running(); });
    if (any || stage_ != Stage::stopping) return;
    stage_ = Stage::stopped;
    if (!recorder_->running()) return loop_.stop();
    // What was published last reaches the recorder before it ends.
    loop_.after(200 * millisecond, [this] { recorder_->signal(SIGTERM); });
    loop_.after(time_to_stop, [this] { recorder_->signal(SIGKILL); });
  }

  enum class Stage { running, stopping, stopped };

  const RunFiles& files_;
  bool with_console_;
  ProcessLoop& loop_;
  ProcedureClient client_;
  std::deque<WatchedProcess> children_;
  WatchedProcess* recorder_ = nullptr;
  WatchedProcess* procedure_ = nullptr;
  WatchedProcess* devices_ = nullptr;
  Stage stage_ = Stage::running;
  bool aborting_ = false;
  bool troubled_ = false;
  int console_starts_ = 0;
  int exit_code_ = exit_code::error;
};

}  // namespace

int supervise(const RunFiles& files, bool with_console) {
  const Utime offset = clock_offset_now();
  setenv("BERTH_CLOCK_OFFSET_US", std::to_string(offset).c_str(), 1);
  const ActiveRunEntry entry(files.directory, bus_url(files.url));
  int code = exit_code::error;
  std::string failure;
  try {
    ProcessLoop loop(offset);
    Supervisor* receiver = nullptr;
    loop.on_signals([&receiver](int) {
      if (receiver != nullptr) receiver->on_signal();
    });
    LcmBus bus(files.url, loop);
    Supervisor supervisor(files, with_console, bus, loop);
    receiver = &supervisor;
    bus.start();
    supervisor.start();
    loop.run();
    code = supervisor.exit_code();
  } catch (const std::exception& e) {
    failure = e.what();
    std::fprintf(stderr, "berth: %s\n", failure.c_str());
  }
  return files.has_procedure ? write_verdict(files, code, failure) : code;
}

std::unique_ptr<ChildProcess> supervise_in_background(const RunFiles& files, bool with_console) {
  const std::filesystem::path file = files.directory / "output" / "supervisor.txt";
  const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  ChildOptions options;
  options.output = options.errors = out;
  options.own_session = true;
  options.dies_with_parent = false;
  options.outlives_object = true;
  auto child = std::make_unique<ChildProcess>(
      [&] {
        try {
          return supervise(files, with_console);
        } catch (const std::exception& e) {
          print_text(std::string(e.what()) + "\n", stderr);
          return exit_code::error;
        }
      },
      options);
  close(out);
  return child;
}

}  // namespace berth
