// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/worker_loop.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/time.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "app/batch/campaigns/results.h"
#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::campaigns {
namespace {

/// A trial that takes longer ends its process with SIGPROF.
void limit_processor_time(double limit_s) {
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(limit_s);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (limit_s - std::floor(limit_s)));
  setitimer(ITIMER_PROF, &timer, nullptr);
}

void write_all(int to, const std::string& text, const std::filesystem::path& file) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = write(to, text.data() + written, text.size() - written);
    if (n < 0) throw InputError(file.string() + ": cannot be written");
    written += static_cast<std::size_t>(n);
  }
}

/// The whole lines that an earlier worker left.
std::string taken_over(const std::filesystem::path& file, std::int64_t begin, std::int64_t& next) {
  std::string text;
  next = begin;
  for (const TrialResult& result : read_whole_lines(file)) {
    if (result.index != next) break;
    text += line_of(result) + "\n";
    ++next;
  }
  return text;
}

void run_block(const Campaign& campaign, Experiment& experiment, const Block& block, int news) {
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
  say(news, "had " + std::to_string(next - block.begin));
  for (; next < block.end; ++next) {
    limit_processor_time(manifest.trial_limit_s);
    const std::string line = line_of(experiment.run(trial_of(manifest, next))) + "\n";
    limit_processor_time(0);
    write_all(out, line, file);
    lines += line;
    say(news, "trial");
  }
  close(out);
  write_file(campaign.block_file(block), lines);
  std::filesystem::remove(file);
  say(news, "block");
}

}  // namespace

void say(int to, const std::string& line) {
  const std::string text = line + "\n";
  [[maybe_unused]] const ssize_t n = write(to, text.data(), text.size());
}

void work(const Campaign& campaign, Experiment& experiment, int blocks, int news) {
  say(news, "ready");
  std::FILE* in = fdopen(blocks, "r");
  long long begin = 0;
  long long end = 0;
  while (in != nullptr && std::fscanf(in, "%lld %lld", &begin, &end) == 2) {
    run_block(campaign, experiment, {begin, end}, news);
  }
}

}  // namespace berth::campaigns
