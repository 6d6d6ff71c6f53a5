// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/terminal_progress.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "lcmtypes/channels.h"
#include "logs/file/log_event.h"

namespace berth {
namespace {

template <class Message>
bool take_as(const char* of, const std::string& channel, Bytes bytes,
             terminal::Progress& progress) {
  if (channel != of) return false;
  if (const auto message = logs::decode<Message>(bytes)) progress.on(*message);
  return true;
}

}  // namespace

TerminalProgress::TerminalProgress()
    : progress_([this](const std::string& line) { print(line); }),
      is_terminal_(isatty(STDOUT_FILENO) == 1) {}

void TerminalProgress::take(const std::string& channel, Bytes bytes) {
  take_as<procedure_state_t>(channels::procedure_state, channel, bytes, progress_) ||
      take_as<pose_estimate_t>(channels::pose_estimate, channel, bytes, progress_) ||
      take_as<ground_truth_t>(channels::ground_truth, channel, bytes, progress_) ||
      take_as<testbed_state_t>(channels::testbed_state, channel, bytes, progress_) ||
      take_as<event_t>(channels::event, channel, bytes, progress_);
}

void TerminalProgress::refresh() {
  const double now =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  if (!is_terminal_ || now - last_refresh_s_ < 0.1) return;
  last_refresh_s_ = now;
  clear_line();
  std::printf("%s", progress_.status().c_str());
  std::fflush(stdout);
  line_shown_ = true;
}

void TerminalProgress::print(const std::string& line) {
  clear_line();
  std::printf("%s\n", line.c_str());
  std::fflush(stdout);
}

void TerminalProgress::clear_line() {
  if (line_shown_) std::printf("\r\x1b[K");
  line_shown_ = false;
}

void show_verdict(const RunFiles& files) {
  std::ifstream in(files.directory / "verdict.txt");
  std::cout << '\n' << in.rdbuf() << "\nrun: " << files.directory.string() << '\n';
}

}  // namespace berth
