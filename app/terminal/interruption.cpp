// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/interruption.h"

#include <atomic>
#include <csignal>

namespace berth::terminal {
namespace {

std::atomic<bool> came = false;

}  // namespace

void watch_for_interruption() {
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { came = true; });
}

void end_on_interruption() {
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, SIG_DFL);
}

bool interrupted() { return came; }

}  // namespace berth::terminal
