// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/raw_terminal.h"

#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <cstdlib>

namespace berth::terminal {
namespace {

// What a signal handler may look at.
termios as_found;
volatile sig_atomic_t changed = 0;

void restore() {
  if (changed == 0) return;
  changed = 0;
  tcsetattr(STDIN_FILENO, TCSANOW, &as_found);
}

/// The signal's own effect comes after it: the handler is gone by then (SA_RESETHAND).
void restore_and_die(int number) {
  restore();
  raise(number);
}

constexpr int deadly[] = {SIGHUP, SIGQUIT, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGPIPE};

}  // namespace

RawTerminal::RawTerminal() {
  if (isatty(STDIN_FILENO) != 1 || isatty(STDOUT_FILENO) != 1) return;
  if (tcgetpgrp(STDIN_FILENO) != getpgrp()) return;  // in the background: the keys are the shell's
  if (tcgetattr(STDIN_FILENO, &as_found) != 0) return;
  termios raw = as_found;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 1;
  raw.c_cc[VTIME] = 0;
  raw.c_cc[VSUSP] = _POSIX_VDISABLE;
  static const bool at_exit = std::atexit(restore) == 0;
  static_cast<void>(at_exit);
  struct sigaction action {};
  action.sa_handler = restore_and_die;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int number : deadly) sigaction(number, &action, nullptr);
  changed = 1;
  active_ = tcsetattr(STDIN_FILENO, TCSANOW, &raw) == 0;
}

RawTerminal::~RawTerminal() {
  restore();
  if (!active_) return;
  for (const int number : deadly) signal(number, SIG_DFL);
}

}  // namespace berth::terminal
