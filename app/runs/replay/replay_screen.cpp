// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/replay_screen.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>

#include "app/terminal/style.h"
#include "common/core/valid_text.h"

namespace berth {
namespace {

std::size_t terminal_width() {
  winsize size{};
  const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0;
  return known ? size.ws_col : 80;
}

}  // namespace

ReplayScreen::ReplayScreen() : is_terminal_(isatty(STDOUT_FILENO) == 1) {}

void ReplayScreen::print(const std::string& line) {
  const std::string status = status_;
  clear();
  print_text(line + "\n");
  if (!status.empty()) this->status(status);
  std::fflush(stdout);
}

void ReplayScreen::status(const std::string& line) {
  if (!is_terminal_) return;
  status_ = line;
  const bool colours = terminal::colours_wanted(STDOUT_FILENO);
  const std::string shown =
      terminal::Line(line, terminal::Style::strong).rendered(colours, terminal_width() - 1);
  std::printf("\r%s\x1b[K", shown.c_str());
  std::fflush(stdout);
}

void ReplayScreen::clear() {
  if (!status_.empty()) std::printf("\r\x1b[K");
  status_.clear();
}

std::string text_of_position(double seconds) {
  char text[40];
  const int hours = static_cast<int>(seconds / 3600);
  if (hours == 0) {
    std::snprintf(text, sizeof text, "%.3f s", seconds);
  } else {
    const int minutes = static_cast<int>(seconds / 60) % 60;
    std::snprintf(text, sizeof text, "%d:%02d:%04.1f", hours, minutes, std::fmod(seconds, 60.0));
  }
  return text;
}

}  // namespace berth
