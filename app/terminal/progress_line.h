// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

namespace berth::terminal {

/// Where progress is written, and by which clock.
struct ProgressOutput {
  std::FILE* line = stderr;
  std::FILE* lasting = stdout;
  std::function<double()> now_s;  ///< empty: a steady clock
};

/// How far long work is, with the time elapsed and to go. On a terminal: one line, rewritten in
/// place and gone with this object. Elsewhere: a line for every twentieth part of what is counted,
/// and one a minute. Any thread.
class ProgressLine {
 public:
  /// Work of which the share done is known: "WHAT: 42 %". Where it is over within a second nothing
  /// is shown.
  explicit ProgressLine(std::string what, ProgressOutput output = {});
  /// Work on things that are counted: "4 of 9 WHAT".
  ProgressLine(std::string what, std::int64_t total, ProgressOutput output = {});
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// @param done share (0 to 1) or count
  /// @param more is shown behind it
  /// @param before count that was done already when this began: nothing follows from it for the
  /// time to go
  void show(double done, const std::string& more = "", double before = 0);
  /// On a terminal this text alone, or no line where it is empty; nothing elsewhere.
  void status(const std::string& text);
  /// A lasting line, above the one of progress.
  void print(const std::string& line);
  /// s since this was made.
  double elapsed_s() const { return output_.now_s() - begun_s_; }

 private:
  std::string text(double done, const std::string& more, double rate, double elapsed_s) const;
  void draw(const std::string& text);

  std::string what_;
  std::optional<std::int64_t> total_;
  ProgressOutput output_;
  double begun_s_ = 0;
  bool on_terminal_ = false;
  std::mutex mutex_;       // of what follows
  std::string shown_;      // on the terminal now
  std::int64_t part_ = 0;  // the last twentieth part that has its line
  double written_s_ = 0;   // since this was made
};

}  // namespace berth::terminal
