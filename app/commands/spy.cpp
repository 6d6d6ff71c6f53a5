// SPDX-License-Identifier: BSD-3-Clause
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cctype>
#include <chrono>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <memory>

#include "app/commands/commands.h"
#include "app/commands/log/verbs.h"
#include "app/exit_code.h"
#include "app/runs/run_list.h"
#include "app/terminal/raw_terminal.h"
#include "app/terminal/spy_model.h"
#include "app/terminal/spy_screen.h"
#include "app/terminal/style.h"
#include "common/bus/lcm_bus.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "logs/file/log_reader.h"
#include "logs/file/timeline.h"
#include "logs/inspect/channel_pattern.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct SpyOptions {
  std::string url;
  log::Paths types;
  std::vector<std::string> what;  ///< channels, or one log
  double once_s = 0;
  bool values = false;
};

volatile sig_atomic_t interrupted = 0;

/// Ages and rates of what is received: a steady clock.
Utime now() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

std::string expression_of(const std::vector<std::string>& channels) {
  std::string all;
  for (const std::string& channel : channels) all += (all.empty() ? "(" : "|(") + channel + ")";
  return all;
}

/// Receives everything on the bus and cannot publish: no Bus, which could.
class Listener {
 public:
  Listener(const std::string& url, const logs::ChannelPattern& pattern, SpyModel& model)
      : url_(bus_url(url)), lcm_(url_), pattern_(pattern), model_(model) {
    if (!lcm_.good()) {
      throw InputError("LCM cannot use " + url_ +
                       ": is there a multicast route? 'berth doctor' shows how to repair it");
    }
    // LCM drops the newest when its own queue is full.
    lcm_.subscribe(".*", &Listener::on_message, this)->setQueueCapacity(100000);
  }

  int descriptor() { return lcm_.getFileno(); }
  const std::string& url() const { return url_; }
  void read() {
    while (lcm_.handleTimeout(0) > 0) {
    }
  }

 private:
  void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
    if (channel == "LCM_SELF_TEST" || !pattern_.matches(channel)) return;
    model_.take(now(), channel,
                {static_cast<const std::uint8_t*>(buffer->data), buffer->data_size});
  }

  std::string url_;
  lcm::LCM lcm_;
  const logs::ChannelPattern& pattern_;
  SpyModel& model_;
};

void print(const SpyModel& model, Utime at, bool live, bool values) {
  for (const std::string& line : channel_table(model, at, live)) print_text(line + "\n");
  if (!values) return;
  for (const auto& [name, channel] : model.channels()) {
    print_text("\n" + terminal_line(name) + "\n");
    for (const std::string& line : field_lines(channel)) print_text("  " + line + "\n");
  }
}

int spy_log(const fs::path& path, const SpyOptions& options) {
  const auto types = log::types_of({path}, options.types);
  SpyModel model(types);
  const logs::ChannelPattern pattern(expression_of({options.what.begin() + 1, options.what.end()}));
  logs::LogReader reader(path);
  const logs::Timeline timeline(reader);
  logs::Timeline::Walker times(timeline);
  logs::LogEvent event;
  Utime last = 0;
  while (reader.next(event)) {
    last = times.position(event.utime);
    const std::string channel(event.channel);
    if (pattern.matches(channel)) model.take(last, channel, event.data);
  }
  print(model, last, false, options.values || options.what.size() > 1);
  return exit_code::passed;
}

/// The terminal, key by key, on its second screen; as it was before when this ends.
class SpyTerminal {
 public:
  SpyTerminal() { show("\x1b[?1049h\x1b[?25l\x1b[2J"); }
  ~SpyTerminal() { show("\x1b[?25h\x1b[?1049l"); }
  SpyTerminal(const SpyTerminal&) = delete;
  SpyTerminal& operator=(const SpyTerminal&) = delete;

  /// The keys pressed since, one after another; empty when there is none.
  std::string next_key() {
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

  void show(const std::string& text) const {
    std::size_t at = 0;
    while (at < text.size()) {
      const ssize_t n = write(STDOUT_FILENO, text.data() + at, text.size() - at);
      if (n <= 0) return;
      at += static_cast<std::size_t>(n);
    }
  }

 private:
  terminal::RawTerminal raw_;
  std::string pressed_;
};

void watch(Listener& listener, const SpyModel& model) {
  SpyTerminal display;
  SpyScreen screen;
  Utime next_draw = 0;
  while (interrupted == 0) {
    pollfd ready[] = {{STDIN_FILENO, POLLIN, 0}, {listener.descriptor(), POLLIN, 0}};
    poll(ready, 2, 50);
    listener.read();
    bool pressed = false;
    for (std::string key = display.next_key(); !key.empty(); key = display.next_key()) {
      pressed = true;
      if (!screen.key(key, model)) return;
    }
    if (!pressed && now() < next_draw) continue;
    next_draw = now() + 200 * millisecond;
    const auto size = terminal::terminal_size(STDOUT_FILENO).value_or(terminal::TerminalSize{});
    display.show(
        screen.draw(model, now(), static_cast<int>(size.rows), static_cast<int>(size.columns)));
  }
}

int spy(const SpyOptions& options) {
  if (!options.what.empty() && fs::exists(options.what[0])) {
    return spy_log(log_of_run(options.what[0]), options);
  }
  const auto types = log::types_of({}, options.types);
  SpyModel model(types);
  const logs::ChannelPattern pattern(expression_of(options.what));
  Listener listener(options.url, pattern, model);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) signal(number, [](int) { interrupted = 1; });
  const bool in_terminal =
      terminal::terminal_size(STDIN_FILENO) && terminal::terminal_size(STDOUT_FILENO);
  if (in_terminal && options.once_s <= 0) {
    watch(listener, model);
    return exit_code::passed;
  }
  const Utime end = now() + utime_from_seconds(options.once_s > 0 ? options.once_s : 2);
  while (interrupted == 0 && now() < end) {
    pollfd ready = {listener.descriptor(), POLLIN, 0};
    poll(&ready, 1, 50);
    listener.read();
  }
  print(model, now(), true, options.values || !options.what.empty());
  if (model.channels().empty()) {
    std::fprintf(stderr, "berth: no message was received on %s\n", listener.url().c_str());
    return exit_code::failed;
  }
  return exit_code::passed;
}

}  // namespace

void add_spy(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "spy",
      "Show what is on the bus: channels, types, rates, sizes, gaps, ages, values. Only listens.\n"
      "In a terminal: arrows or a number and Enter open a channel, q leaves. Elsewhere, or with\n"
      "--once: a table, then the end. With a log or run directory: its last messages");
  auto options = std::make_shared<SpyOptions>();
  command->add_option("what", options->what,
                      "Channels (regular expressions), all when left out; or a log, then channels");
  command->add_option("--lcm-url", options->url, "Bus; LCM_DEFAULT_URL when left out");
  command->add_option("--types", options->types,
                      "More message types: a .lcm file or a directory of them; once for each");
  command->add_option("--once", options->once_s, "Listen so many seconds, print, and end")
      ->check(CLI::PositiveNumber);
  command->add_flag("--values", options->values, "Print the newest message of every channel too");
  command->callback([options, &exit_code] { exit_code = spy(*options); });
}

}  // namespace berth::commands
