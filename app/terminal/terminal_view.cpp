// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/terminal_view.h"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>

#include "common/core/valid_text.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_event.h"

namespace berth::terminal {
namespace {

template <class Message>
bool take_as(const char* of, const std::string& channel, Bytes bytes, Progress& progress) {
  if (channel != of) return false;
  if (const auto message = logs::decode<Message>(bytes)) progress.on(*message);
  return true;
}

}  // namespace

TerminalView::TerminalView()
    : is_terminal_(terminal_size(STDOUT_FILENO).has_value()),
      progress_([this](const Line& line) { print(line); }, is_terminal_),
      colours_(use_colours(STDOUT_FILENO)) {}

void TerminalView::take(const std::string& channel, Bytes bytes) {
  if (channel == channels::procedure_state) {
    if (const procedure_state_t* state = state_.decode(bytes)) progress_.on(*state);
    return;
  }
  const bool lasting = take_as<event_t>(channels::event, channel, bytes, progress_);
  if (lasting || !is_terminal_) return;  // the rest stands in the panel
  take_as<run_info_t>(channels::run_info, channel, bytes, progress_) ||
      take_as<pose_estimate_t>(channels::pose_estimate, channel, bytes, progress_) ||
      take_as<ground_truth_t>(channels::ground_truth, channel, bytes, progress_) ||
      take_as<testbed_state_t>(channels::testbed_state, channel, bytes, progress_) ||
      take_as<operator_control_t>(channels::operator_control, channel, bytes, progress_);
}

void TerminalView::refresh(const std::vector<Line>& below, bool urgent) {
  if (!is_terminal_) return;
  const double now =
      std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  if (!urgent && now - last_refresh_s_ < 0.1) return;
  last_refresh_s_ = now;
  const TerminalSize size = terminal_size(STDOUT_FILENO).value_or(TerminalSize{});
  std::vector<Line> lines = progress_.panel();
  lines.insert(lines.begin(), Line(std::string(size.columns - 1, '-'), Style::faint));
  // what is below it is what the operator types: the panel gives way
  const std::size_t room = std::max<std::size_t>(4, size.rows - 1) - 1;
  const std::size_t kept = room > below.size() ? room - below.size() : 1;
  if (lines.size() > kept) lines.resize(kept);
  lines.insert(lines.end(), below.begin(), below.end());
  std::string out = panel_lines_ > 0 ? "\x1b[" + std::to_string(panel_lines_) + "A\r" : "";
  for (const Line& line : lines) {
    out += line.rendered(colours_, std::max<std::size_t>(1, size.columns - 1)) + "\x1b[K\n";
  }
  out += "\x1b[J";
  panel_lines_ = lines.size();
  std::fwrite(out.data(), 1, out.size(), stdout);
  std::fflush(stdout);
}

void TerminalView::print(const Line& line) {
  clear_panel();
  std::printf("%s\n", line.rendered(colours_).c_str());
  std::fflush(stdout);
}

void TerminalView::clear_panel() {
  if (panel_lines_ == 0) return;
  std::printf("\x1b[%zuA\r\x1b[J", panel_lines_);
  std::fflush(stdout);
  panel_lines_ = 0;
}

void print_verdict(const std::string& text) {
  const auto terminal = terminal_size(STDOUT_FILENO);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const bool of_table = terminal && line.rfind("  ", 0) == 0;
    std::cout << Line(line).rendered(false, of_table ? terminal->columns : 0) << '\n';
  }
  std::cout.flush();
}

void show_verdict(const RunFiles& files) {
  std::ifstream in(files.directory / "verdict.txt");
  std::ostringstream verdict;
  if (!(verdict << in.rdbuf())) verdict.str("verdict: ERROR (it could not be written)\n");
  std::string text = "\n" + verdict.str() + "run: " + files.directory.string() + "\n";
  const std::filesystem::path report = files.directory / "report.html";
  if (std::filesystem::exists(report)) text += "report: " + report.string() + "\n";
  print_verdict(text);
}

}  // namespace berth::terminal
