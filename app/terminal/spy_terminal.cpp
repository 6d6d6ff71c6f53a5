// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/spy_terminal.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cctype>

namespace berth {
namespace {

winsize size_now() {
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0) {
    size.ws_row = 24;
    size.ws_col = 80;
  }
  return size;
}

void put(const std::string& text) {
  std::size_t at = 0;
  while (at < text.size()) {
    const ssize_t n = write(STDOUT_FILENO, text.data() + at, text.size() - at);
    if (n <= 0) return;
    at += static_cast<std::size_t>(n);
  }
}

}  // namespace

SpyTerminal::SpyTerminal() { put("\x1b[?1049h\x1b[?25l\x1b[2J"); }

SpyTerminal::~SpyTerminal() { put("\x1b[?25h\x1b[?1049l"); }

std::string SpyTerminal::next_key() {
  char bytes[64];
  pollfd ready = {STDIN_FILENO, POLLIN, 0};
  const bool pressed = poll(&ready, 1, 0) > 0 && (ready.revents & POLLIN) != 0;
  const ssize_t n = !pressed ? 0 : read(STDIN_FILENO, bytes, sizeof bytes);
  if (n > 0) pressed_.append(bytes, static_cast<std::size_t>(n));
  if (pressed_.empty()) return "";
  std::size_t length = 1;
  if (pressed_.size() > 2 && pressed_[0] == '\x1b' && pressed_[1] == '[') {
    length = 3;
    while (length < pressed_.size() &&
           std::isdigit(static_cast<unsigned char>(pressed_[length - 1]))) {
      ++length;
    }
  }
  const std::string key = pressed_.substr(0, length);
  pressed_.erase(0, length);
  return key;
}

void SpyTerminal::show(const std::string& text) const { put(text); }

int SpyTerminal::rows() const { return size_now().ws_row; }
int SpyTerminal::columns() const { return size_now().ws_col; }

}  // namespace berth
