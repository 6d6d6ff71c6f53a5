// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/replay.h"

#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>

#include "app/batch/reestimation/new_run.h"
#include "app/exit_code.h"
#include "app/runs/replay/live_estimator.h"
#include "app/runs/replay/replay_bus.h"
#include "app/runs/run_list.h"
#include "app/terminal/progress_line.h"
#include "app/terminal/raw_terminal.h"
#include "common/bus/process_loop.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

namespace fs = std::filesystem;

/// A directory that is gone with it.
struct ScratchDirectory {
  fs::path path;
  ScratchDirectory() {
    std::string name = (temporary_directory() / "berth-replay-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw InputError("cannot make " + name);
    path = name;
  }
  ~ScratchDirectory() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
};

std::string describe(const heartbeat_t& beat, const std::string& url) {
  return "node '" + beat.node + "' (session " + std::to_string(beat.session) + ") is alive on " +
         url + ": a log must not be played into a cell";
}

/// "12.345 s", or "1:02:03.4" from an hour on.
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

class Replay {
 public:
  explicit Replay(const ReplayRequest& request)
      : log_(log_of_run(request.run.string())),
        screen_(log_.string()),
        index_(log_, [this](double share) { screen_.show(share); }),
        channels_(request.remap, request.only, request.without),
        force_(request.force),
        loop_(clock_offset_now()),
        player_(
            index_, request.player, [this](const logs::LogEvent& event) { emit(event); },
            [this](std::size_t place) { jumped(place); }),
        sessions_(index_.sessions()) {
    screen_.status("");
    loop_.on_signals([this](int) { stop(exit_code::aborted); });  // before there are threads
    bus_ = std::make_unique<ReplayBus>(request.url);
    if (index_.empty()) throw InputError(log_.string() + ": holds no message");
    if (!force_) {
      if (const auto beat = bus_->anybody_alive()) {
        throw InputError(describe(*beat, bus_->url()) +
                         "; use another --lcm-url, or --force if nothing there can move");
      }
    }
    if (!request.estimate) return;
    channels_.rename(channels::pose_estimate, recorded_estimate_channel);
    files_ = make_new_run(log_, {request.config, request.set}, scratch_.path / "run");
    sessions_.insert(files_.setup.session);
    pairs_ = std::make_unique<EstimatePairs>(
        index_.first(), [this](const std::string& line) { screen_.print(line); });
    live_ = std::make_unique<LiveEstimator>(
        files_, index_.first(),
        [this](const std::string& channel, Bytes bytes) { publish_live(channel, bytes); });
  }

  int run() {
    screen_.print(log_.string() + ": " + std::to_string(index_.size()) + " messages in " +
                  text_of_position(seconds(index_.last() - index_.first())) + ", onto " +
                  bus_->url());
    print_steps();
    if (terminal_.active()) {
      screen_.print(
          "space pause   . step   n next estimate   arrows 1 and 10 s   [ ] rate   "
          "l loop   q quit");
      loop_.watch(STDIN_FILENO, [this] { read_keys(); });
      loop_.every(100 * millisecond, [this] { show_status(); });
    }
    if (pairs_) screen_.print(EstimatePairs::heading());
    loop_.watch(bus_->descriptor(), [this] { receive(); });
    if (live_ && player_.position(0) > 0)
      jumped(index_.not_before(index_.first() + player_.position(0)));
    player_.start(loop_.now());
    tick();
    loop_.run();
    if (live_ && exit_code_ == exit_code::passed) live_->finish();
    return summary();
  }

 private:
  /// Where the log's clock was set: what lies between is neither waited for nor sent at once.
  void print_steps() {
    constexpr std::size_t max_shown = 10;
    const auto& steps = index_.steps();
    for (std::size_t i = 0; i < std::min(steps.size(), max_shown); ++i)
      screen_.print(steps[i].text());
    if (steps.size() > max_shown) {
      screen_.print("and " + std::to_string(steps.size() - max_shown) + " more: berth log check");
    }
  }

  void tick() {
    const Utime now = loop_.now();
    player_.run(now);
    if (player_.finished()) return stop(exit_code::passed);
    loop_.cancel(timer_);
    if (const auto due = player_.next_due()) timer_ = loop_.at(*due, [this] { tick(); });
  }

  void stop(int code) {
    exit_code_ = code;
    loop_.stop();
  }

  void emit(const logs::LogEvent& event) {
    if (live_) {
      live_->take(event);
      if (event.channel == channels::pose_estimate) {
        if (const auto message = logs::decode<pose_estimate_t>(event.data)) {
          const std::lock_guard lock(mutex_);
          pairs_->recorded(*message);
        }
      } else if (EstimatorFold::is_output(event)) {
        return;  // the live one's come instead
      }
    }
    const auto name = channels_.name_of(event.channel);
    if (!name) return;
    publish(*name, event.data);
    ++played_;
  }

  /// What the network does not take is reported at the end; the rest goes on.
  void publish(const std::string& channel, Bytes bytes) {
    if (!bus_->publish(channel, bytes)) ++unsent_;
  }

  /// On the live estimator's thread.
  void publish_live(const std::string& channel, Bytes bytes) {
    publish(channel, bytes);
    if (channel != channels::pose_estimate) return;
    if (const auto message = logs::decode<pose_estimate_t>(bytes)) {
      const std::lock_guard lock(mutex_);
      pairs_->live(*message);
    }
  }

  /// An estimator that comes in here receives what was commanded before.
  void jumped(std::size_t place) {
    if (!live_) return;
    live_->restart(index_.time(std::min(place, index_.size() - 1)));
    for (std::size_t i = index_.next_of(channels::estimator_command, 0); i < place;
         i = index_.next_of(channels::estimator_command, i + 1)) {
      live_->take(index_.at(i));
    }
    const std::lock_guard lock(mutex_);
    pairs_->forget();
  }

  void receive() {
    const auto beat = bus_->receive_stranger(sessions_);
    if (!beat || force_) return;
    complaint_ = describe(*beat, bus_->url());
    stop(exit_code::error);
  }

  void read_keys() {
    char keys[64];
    const ssize_t count = read(STDIN_FILENO, keys, sizeof keys);
    if (count <= 0) return stop(exit_code::passed);
    const std::string text(keys, static_cast<std::size_t>(count));
    for (std::size_t i = 0; i < text.size(); ++i) {
      const bool arrow = text.compare(i, 2, "\x1b[") == 0 && i + 2 < text.size();
      if (arrow) i += 2;
      arrow ? on_arrow(text[i]) : on_key(text[i]);
    }
    tick();
    show_status();
  }

  void on_arrow(char arrow) {
    const Utime by = arrow == 'C'   ? second
                     : arrow == 'D' ? -second
                     : arrow == 'A' ? 10 * second
                     : arrow == 'B' ? -10 * second
                                    : 0;
    if (by != 0) player_.seek(by, loop_.now());
  }

  void on_key(char key) {
    const Utime now = loop_.now();
    switch (key) {
      case ' ':
        return player_.pause_or_go(now);
      case '.':
        return player_.step(now);
      case 'n':
        return player_.step_to(channels::pose_estimate, now);
      case '[':
        return player_.change_rate(0.5, now);
      case ']':
        return player_.change_rate(2, now);
      case 'l':
        return player_.loop_or_not();
      case 'q':
        return stop(exit_code::passed);
      default:
        return;
    }
  }

  void show_status() {
    const Utime now = loop_.now();
    char text[200];
    std::snprintf(text, sizeof text, "%s  %s of %s  x%g%s", player_.paused() ? "paused" : "plays",
                  text_of_position(seconds(player_.position(now))).c_str(),
                  text_of_position(seconds(index_.last() - index_.first())).c_str(), player_.rate(),
                  player_.loops() ? "  loop" : "");
    std::string line = text;
    const auto next = player_.until_next(now);
    if (!next) {
      line += "  at the end";
    } else if (*next >= second / 5) {
      line += "  next message in " + text_of_position(seconds(*next));
    }
    if (live_ && live_->waiting() > 0) {
      line += "  live estimator behind by " + std::to_string(live_->waiting());
    }
    screen_.status(line);
  }

  int summary() {
    screen_.print(std::to_string(played_) + " messages played" +
                  (index_.damaged_bytes() > 0 ? "; " + std::to_string(index_.damaged_bytes()) +
                                                    " damaged bytes of the log passed over"
                                              : ""));
    if (pairs_) screen_.print(pairs_->summary());
    if (unsent_ > 0) {
      complaint_ = std::to_string(unsent_) + " messages could not be sent on " + bus_->url();
    }
    if (live_ && complaint_.empty()) complaint_ = live_->error();
    if (complaint_.empty()) return exit_code_;
    print_text("berth: " + complaint_ + "\n", stderr);
    return exit_code::error;
  }

  fs::path log_;
  terminal::ProgressLine screen_;
  LogIndex index_;
  ChannelMap channels_;
  bool force_;
  std::unique_ptr<ReplayBus> bus_;
  ProcessLoop loop_;
  Player player_;
  std::set<std::int64_t> sessions_;
  terminal::RawTerminal terminal_;
  std::mutex mutex_;  // of pairs_: the live estimator has a thread of its own
  std::unique_ptr<EstimatePairs> pairs_;
  ScratchDirectory scratch_;
  RunFiles files_;
  std::unique_ptr<LiveEstimator> live_;
  Loop::TimerId timer_ = 0;
  int exit_code_ = exit_code::passed;
  std::string complaint_;
  std::int64_t played_ = 0;  // messages of the log
  std::atomic<std::int64_t> unsent_ = 0;
};

}  // namespace

int replay(const ReplayRequest& request) { return Replay(request).run(); }

}  // namespace berth
