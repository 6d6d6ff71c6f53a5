// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/monitor.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/exit_code.h"
#include "app/hosts/child_process.h"
#include "app/runs/run_files.h"
#include "app/terminal/terminal_progress.h"
#include "common/bus/lcm_bus.h"
#include "common/core/error.h"
#include "lcmtypes/channels.h"
#include "logs/compare/comparison.h"

namespace berth {
namespace {

template <class Message>
void show(Bus& bus, const char* channel, std::int64_t session, TerminalProgress& progress) {
  bus.subscribe<Message>(channel, Queue::fifo(), [session, &progress](const Message& message) {
    if (message.session == session) progress.on(message);
  });
}

/// Asks the supervisor to stop: it aborts the procedure at the first, and kills at the second time.
void ask_to_stop(pid_t supervisor, int times) {
  if (times == 1) {
    std::printf("\naborting; once more stops everything at once\n");
  } else {
    std::printf("\nstopping everything\n");
  }
  kill(supervisor, SIGTERM);
}

/// Of a child or of somebody else's process.
void wait_for(pid_t pid) { waitpid(pid, nullptr, WNOHANG); }

int exit_code_of(const RunFiles& files, bool interrupted) {
  if (!files.has_procedure) return exit_code::passed;
  if (!std::filesystem::exists(files.log())) return exit_code::error;
  try {
    const auto outcome = logs::compare_log(files.log()).outcome;
    if (outcome != procedure_state_t::NONE) return logs::exit_code_of_outcome(outcome);
  } catch (const InputError&) {
    // died before its procedure spoke: verdict.txt says why
  }
  return interrupted ? exit_code::aborted : exit_code::error;
}

}  // namespace

int monitor(const ActiveRun& run) {
  const RunFiles files = RunFiles::open(run.directory);
  const int supervisor_fd = descriptor_of_process(run.supervisor);
  int interrupts = 0;
  if (supervisor_fd >= 0) {
    ProcessLoop loop(clock_offset_now());
    loop.on_signals([&](int) { ask_to_stop(run.supervisor, ++interrupts); });
    TerminalProgress progress;
    LcmBus bus(run.url, loop);
    show<procedure_state_t>(bus, channels::procedure_state, files.setup.session, progress);
    show<pose_estimate_t>(bus, channels::pose_estimate, files.setup.session, progress);
    show<ground_truth_t>(bus, channels::ground_truth, files.setup.session, progress);
    show<testbed_state_t>(bus, channels::testbed_state, files.setup.session, progress);
    show<event_t>(bus, channels::event, files.setup.session, progress);
    loop.watch(supervisor_fd, [&] {
      loop.unwatch(supervisor_fd);
      loop.stop();
    });
    loop.every(200 * millisecond, [&] { progress.refresh(); });
    bus.start();
    if (!files.has_procedure) {
      std::printf("the cell is up on %s; Ctrl-C brings it down\n", run.url.c_str());
      std::fflush(stdout);
    }
    loop.run();
    close(supervisor_fd);
    wait_for(run.supervisor);
  }
  if (files.has_procedure) show_verdict(files);
  return exit_code_of(files, interrupts > 0);
}

}  // namespace berth
