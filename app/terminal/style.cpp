// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/style.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string_view>

#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::terminal {
namespace {

const char* code_of(Style style) {
  switch (style) {
    case Style::strong:
      return "\x1b[1m";
    case Style::faint:
      return "\x1b[2m";
    case Style::good:
      return "\x1b[32m";
    case Style::warning:
      return "\x1b[33m";
    case Style::bad:
      return "\x1b[1;31m";
    default:
      return "";
  }
}

}  // namespace

std::optional<TerminalSize> terminal_size(int fd) {
  if (isatty(fd) != 1) return std::nullopt;
  winsize size{};
  if (ioctl(fd, TIOCGWINSZ, &size) != 0 || size.ws_row == 0 || size.ws_col == 0) {
    return TerminalSize{};
  }
  return TerminalSize{size.ws_row, size.ws_col};
}

bool use_colours(int fd) {
  const char* forbidden = std::getenv("NO_COLOR");
  if (forbidden != nullptr && *forbidden != '\0') return false;
  const char* kind = std::getenv("TERM");
  return terminal_size(fd) && kind != nullptr && std::string_view(kind) != "dumb";
}

Line& Line::add(const std::string& text, Style style) {
  parts_.push_back({terminal_line(text), style});
  return *this;
}

Line& Line::tab(std::size_t column) {
  const std::size_t here = width();
  return add(std::string(here < column ? column - here : 1, ' '));
}

std::size_t Line::width() const {
  std::size_t sum = 0;
  for (const Part& part : parts_) sum += columns(part.text);
  return sum;
}

std::string Line::rendered(bool colours, std::size_t width) const {
  std::string out;
  std::size_t left = width;
  for (const Part& part : parts_) {
    std::string text = part.text;
    if (width > 0) {
      text = first_columns(part.text, left);
      left -= columns(text);
    }
    const bool coloured = colours && part.style != Style::plain && !text.empty();
    out += coloured ? code_of(part.style) + text + "\x1b[0m" : text;
  }
  return out;
}

std::vector<std::string> wrapped(const std::string& text, std::size_t width) {
  std::vector<std::string> lines(1);
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (!lines.back().empty() && columns(lines.back()) + 1 + columns(word) > width) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + word;
  }
  return lines;
}

std::string text_of_duration(double seconds) {
  if (seconds < 99.95) return fixed(seconds, 1) + " s";
  const auto whole = std::llround(seconds);
  char text[64];
  if (whole < 3600) {
    std::snprintf(text, sizeof text, "%lld min %02lld s", whole / 60, whole % 60);
  } else {
    std::snprintf(text, sizeof text, "%lld h %02lld min", whole / 3600, whole % 3600 / 60);
  }
  return text;
}

}  // namespace berth::terminal
