// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/worker.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/time.h>
#include <unistd.h>

#include <cmath>

#include "app/batch/campaigns/results.h"
#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

/// A trial that takes longer ends its process with SIGPROF.
void limit_processor_time(double limit_s) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(limit_s);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (limit_s - std::floor(limit_s)));
  setitimer(ITIMER_PROF, &timer, nullptr);
}

void write_all(int to, const std::string& text, const fs::path& file) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = write(to, text.data() + written, text.size() - written);
    if (n < 0) throw InputError(file.string() + ": cannot be written");
    written += static_cast<std::size_t>(n);
  }
}

/// The whole lines that an earlier worker left.
std::string taken_over(const fs::path& file, std::int64_t begin, std::int64_t& next) {
  std::string text;
  next = begin;
  for (const TrialResult& result : read_whole_lines(file)) {
    if (result.index != next) break;
    text += line_of(result) + "\n";
    ++next;
  }
  return text;
}

void run_block(const Campaign& campaign, Experiment& experiment, const Block& block,
               WorkerReport& report) {
  const Manifest& manifest = campaign.manifest();
  const auto file = campaign.started_file(block);
  std::int64_t next = 0;
  const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (out < 0) throw InputError(file.string() + ": cannot be written");
  // A cluster's tasks share the directory, each with blocks of its own.
  if (flock(out, LOCK_EX | LOCK_NB) != 0) {
    throw InputError(file.string() + ": another berth is at work on these trials");
  }
  std::string lines = taken_over(file, block.begin, next);
  if (ftruncate(out, 0) != 0) throw InputError(file.string() + ": cannot be written");
  write_all(out, lines, file);
  report.in_block = next - block.begin;
  for (; next < block.end; ++next) {
    limit_processor_time(manifest.trial_limit_s);
    const std::string line = line_of(experiment.run(trial_of(manifest, next))) + "\n";
    limit_processor_time(0);
    write_all(out, line, file);
    lines += line;
    ++report.ran;
    ++report.in_block;
  }
  close(out);
  write_file(campaign.block_file(block), lines);
  fs::remove(file);
}

}  // namespace

fs::path work_directory_of(pid_t worker) {
  return temporary_directory() / ("berth-worker-" + std::to_string(worker));
}

void work(const Campaign& campaign, const std::vector<Block>& blocks,
          const std::function<std::unique_ptr<Experiment>()>& make_experiment, std::int64_t first,
          std::atomic<std::int64_t>& next, WorkerReport& report) {
  signal(SIGINT, SIG_IGN);  // the terminal's: the parent decides
  for (const int number : {SIGTERM, SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGBUS}) {
    signal(number, SIG_DFL);  // whatever the parent does with them
  }
  const auto experiment = make_experiment();
  report.ready = true;
  for (std::int64_t i = first != WorkerReport::none ? first : next++; i < std::ssize(blocks);
       i = next++) {
    const Block& block = blocks[static_cast<std::size_t>(i)];
    report.block = i;
    run_block(campaign, *experiment, block, report);
    report.block = WorkerReport::none;
    report.in_block = 0;
    report.finished += block.size();
  }
}

}  // namespace berth::campaigns
