// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace berth::terminal {

/// The terminal on stdin, key by key and without echo, as long as this lives. Ctrl-C stays a
/// signal; Ctrl-Z does nothing. Restored in every case: at the end, on exit(), and when a signal
/// ends the process. Does nothing where stdin or stdout is no terminal or belongs to another job.
class RawTerminal {
 public:
  RawTerminal();
  ~RawTerminal();
  RawTerminal(const RawTerminal&) = delete;
  RawTerminal& operator=(const RawTerminal&) = delete;

  /// Whether there are keys to read.
  bool active() const { return active_; }

 private:
  bool active_ = false;
};

}  // namespace berth::terminal
