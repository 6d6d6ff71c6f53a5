// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/progress_line.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "app/terminal/style.h"
#include "common/core/text.h"
#include "common/core/utc.h"
#include "common/core/valid_text.h"

namespace berth::terminal {
namespace {

constexpr int parts = 20;
constexpr double between_lines_s = 60;
constexpr double between_draws_s = 0.25;

double steady_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

ProgressLine::ProgressLine(std::string what, ProgressOutput output)
    : what_(std::move(what)), output_(std::move(output)) {
  if (!output_.now_s) output_.now_s = steady_s;
  begun_s_ = output_.now_s();
  on_terminal_ = terminal_size(fileno(output_.line)).has_value();
}

ProgressLine::ProgressLine(std::string what, std::int64_t total, ProgressOutput output)
    : ProgressLine(std::move(what), std::move(output)) {
  total_ = total;
}

ProgressLine::~ProgressLine() { draw(""); }

void ProgressLine::show(double done, const std::string& more, double before) {
  const std::lock_guard lock(mutex_);
  const double elapsed = elapsed_s();
  const double rate = (done - before) / std::max(1.0, elapsed);
  if (on_terminal_) {
    if (!total_ && elapsed < 1) return;
    // where the next comes late none may be left out, else the line would be out of date
    if (rate * between_draws_s > 1 && elapsed - written_s_ < between_draws_s) return;
    written_s_ = elapsed;
    return draw(text(done, more, rate, elapsed));
  }
  const bool countable = total_ && *total_ > 0;
  const auto part =
      countable ? static_cast<std::int64_t>(parts * done / static_cast<double>(*total_)) : 0;
  if (part <= part_ && elapsed - written_s_ < between_lines_s) return;
  part_ = part;
  written_s_ = elapsed;
  print_text(text(done, more, rate, elapsed) + "\n", output_.line);
  std::fflush(output_.line);
}

void ProgressLine::status(const std::string& text) {
  const std::lock_guard lock(mutex_);
  if (on_terminal_) draw(text);
}

void ProgressLine::print(const std::string& line) {
  const std::lock_guard lock(mutex_);
  const std::string text = shown_;
  draw("");
  print_text(line + "\n", output_.lasting);
  std::fflush(output_.lasting);
  draw(text);
}

std::string ProgressLine::text(double done, const std::string& more, double rate,
                               double elapsed_s) const {
  std::string text = what_ + ": " + fixed(std::floor(100 * done), 0) + " %";
  if (total_) text = fixed(done, 0) + " of " + std::to_string(*total_) + " " + what_;
  const bool rate_known = elapsed_s >= 1 && rate > 0;
  if (total_ && rate_known && rate >= 1) text += ", " + fixed(rate, 1) + " a second";
  if (!more.empty()) text += ", " + more;
  text += "; " + clock_text(elapsed_s) + " elapsed";
  const double left = static_cast<double>(total_.value_or(1)) - done;
  if (rate_known && left > 0) text += ", about " + clock_text(left / rate) + " to go";
  return text;
}

void ProgressLine::draw(const std::string& text) {
  if (text == shown_) return;
  shown_ = text;
  std::fflush(output_.lasting);
  const std::string line = terminal_line(text);
  const auto size = terminal_size(fileno(output_.line)).value_or(TerminalSize{});
  const std::string cut(first_columns(line, size.columns - 1));  // a full line would wrap
  std::fprintf(output_.line, "\r%s\x1b[K", cut.c_str());
  std::fflush(output_.line);
}

}  // namespace berth::terminal
