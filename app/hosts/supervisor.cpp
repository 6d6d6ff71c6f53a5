// SPDX-License-Identifier: BSD-3-Clause
#include "app/hosts/supervisor.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <berth/event_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <cstdio>
#include <deque>
#include <fstream>
#include <system_error>

#include "app/exit_code.h"
#include "app/hosts/child_process.h"
#include "app/runs/active_runs.h"
#include "app/runs/verdict.h"
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
                       [this](int code) {
                         if (stage_ == Stage::stopped) return loop_.stop();
                         trouble("lcm-logger ended with code " + std::to_string(code) +
                                 ": nothing is recorded any more");
                       });
  }

  void start_nodes() {
    if (!files_.joins) start_cell();
    if (files_.has_procedure) {
      procedure_ = launch(
          "procedure", program_directory() / "berth-procedure", run_arguments({}),
          [this](int code) { finish(code <= exit_code::inconclusive ? code : exit_code::error); });
    }
    if (with_console_ && !files_.joins) start_console();
    report(node_status_t::RUNNING, "");
  }

  /// It only shows: the run goes on without it.
  void start_console() {
    ++console_starts_;
    launch("console", program_directory() / "berth-console", run_arguments({}), [this](int code) {
      if (stage_ != Stage::running) return children_ended();
      const bool again = console_starts_ < console_tries;
      event(event_t::WARNING, "console-ended",
            "the console ended with code " + std::to_string(code) + ": " + last_words("console") +
                (again ? "; it is started again" : "; it is not started again"));
      if (!again) return;
      loop_.after(time_to_console, [this] {
        if (stage_ == Stage::running) start_console();
      });
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
    node("estimator", "berth-estimator", {});
  }

  ChildProcess* node(const std::string& name, const std::string& program,
                     const std::vector<std::string>& arguments) {
    return launch(
        name, program_directory() / program, run_arguments(arguments), [this, name](int code) {
          if (stage_ != Stage::running) return children_ended();
          trouble(name + " ended with code " + std::to_string(code) + ": " + last_words(name));
        });
  }

  std::vector<std::string> run_arguments(const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"--run", files_.directory.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  ChildProcess* launch(const std::string& name, const std::filesystem::path& program,
                       const std::vector<std::string>& arguments, std::function<void(int)> exited) {
    children_.emplace_back(loop_, name, program, arguments, output_of(name), std::move(exited));
    return &children_.back();
  }

  /// The last line that a process printed.
  std::string last_words(const std::string& name) const {
    std::ifstream in(output_of(name));
    std::string last = "its output is empty";
    for (std::string line; std::getline(in, line);) last = line;
    return last;
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
    // The devices last, so that nobody complains of their silence.
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
    const bool any = std::any_of(children_.begin(), children_.end(), [this](const ChildProcess& c) {
      return &c != recorder_ && c.running();
    });
    if (any || stage_ != Stage::stopping) return;
    stage_ = Stage::stopped;
    if (!recorder_->running()) return loop_.stop();
    // What was said last reaches the recorder before it ends.
    loop_.after(200 * millisecond, [this] { recorder_->signal(SIGTERM); });
    loop_.after(time_to_stop, [this] { recorder_->signal(SIGKILL); });
  }

  enum class Stage { running, stopping, stopped };

  const RunFiles& files_;
  bool with_console_;
  ProcessLoop& loop_;
  ProcedureClient client_;
  std::deque<ChildProcess> children_;
  ChildProcess* recorder_ = nullptr;
  ChildProcess* procedure_ = nullptr;
  ChildProcess* devices_ = nullptr;
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
    Supervisor* told = nullptr;
    loop.on_signals([&told](int) {
      if (told != nullptr) told->on_signal();
    });
    LcmBus bus(files.url, loop);
    Supervisor supervisor(files, with_console, bus, loop);
    told = &supervisor;
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

int supervise_in_background(const RunFiles& files, bool with_console) {
  // The terminal may go away at any moment: between fork and setsid, too.
  sigset_t hangup;
  sigset_t before;
  sigemptyset(&hangup);
  sigaddset(&hangup, SIGHUP);
  sigprocmask(SIG_BLOCK, &hangup, &before);
  const pid_t child = fork();
  if (child != 0) {
    sigprocmask(SIG_SETMASK, &before, nullptr);
    if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
    return child;
  }
  setsid();
  signal(SIGHUP, SIG_IGN);  // of the nodes as well: they inherit it
  sigprocmask(SIG_SETMASK, &before, nullptr);
  const int out = open((files.directory / "output" / "supervisor.txt").c_str(),
                       O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
  dup2(nothing, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(out, STDERR_FILENO);
  int code = exit_code::error;
  try {
    code = supervise(files, with_console);
  } catch (const std::exception& e) {
    print_text(std::string(e.what()) + "\n", stderr);
  }
  std::fflush(nullptr);
  _exit(code);
}

}  // namespace berth
