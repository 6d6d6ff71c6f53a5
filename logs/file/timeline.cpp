// SPDX-License-Identifier: BSD-3-Clause
#include "logs/file/timeline.h"

#include <algorithm>
#include <berth/heartbeat_t.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "common/core/text.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_event.h"

namespace berth::logs {
namespace {

constexpr Utime beat_period = 50 * millisecond;  // heartbeat_t: 20 Hz
constexpr Utime min_step = 128 * millisecond;    // ntpd's step threshold
constexpr Utime shortest_silence = second;       // a busy machine has shorter ones
constexpr Utime max_wait = 60 * second;          // acceptable pause
constexpr std::size_t max_unexplained = 8;       // more silences are how the log is
constexpr double p_value = 1e-9;

/// Where times go back, or a silence that may be one of the clock alone.
struct Break {
  enum class Verdict { unknown, time_passed, step };
  std::int64_t place = 0;
  std::size_t offset = 0;
  std::int64_t number = 0;
  Utime before = 0;
  Utime after = 0;
  bool joined = false;
  Verdict verdict = Verdict::unknown;

  Utime silence() const { return elapsed(before, after); }
};

/// An event as far as time needs it.
struct Mark {
  std::int64_t place = 0;
  std::size_t offset = 0;
  std::int64_t number = 0;
  Utime utime = 0;
  bool restart = false;
  Bytes beat;  ///< empty: no heartbeat
};

}  // namespace

Utime elapsed(Utime from, Utime to) {
  Utime result = 0;
  if (!__builtin_sub_overflow(to, from, &result)) return result;
  return to < from ? std::numeric_limits<Utime>::min() : std::numeric_limits<Utime>::max();
}

Utime later(Utime time, Utime by) {
  Utime result = 0;
  if (!__builtin_add_overflow(time, by, &result)) return result;
  return by < 0 ? std::numeric_limits<Utime>::min() : std::numeric_limits<Utime>::max();
}

class TimelineFinder {
 public:
  explicit TimelineFinder(Timeline& timeline) : timeline_(timeline) {}

  void take(const LogEvent& event, bool restart) {
    Mark mark{places_++, event.offset, event.number, event.utime, restart, {}};
    if (event.channel == channels::heartbeat) mark.beat = event.data;
    if (next_) judge(*next_, mark);
    next_ = mark;
  }

  void finish() {
    if (!next_) return;
    // A last event that is earlier than the one before does not determine those that might follow.
    if (!last_ || next_->utime >= last_->utime) accept(*next_);
    judge_unexplained();
    judge_joints();
    place_stretches();
  }

 private:
  /// Whether an event stands at its time, by its neighbours.
  void judge(Mark mark, const Mark& after) {
    mark.restart = mark.restart || restart_;
    restart_ = false;
    if (last_) {
      const bool between = last_->utime <= mark.utime && mark.utime <= after.utime;
      if (last_->utime <= after.utime && !between) {
        if (mark.utime > after.utime) timeline_.strays_.push_back(mark.place);
        restart_ = mark.restart;
        return;
      }
    }
    accept(mark);
  }

  void accept(const Mark& mark) {
    if (!last_) {
      first_ = mark.utime;
    } else {
      const Utime silence = elapsed(last_->utime, mark.utime);
      if (silence < 0 || silence > shortest_silence) {
        breaks_.push_back({mark.place, mark.offset, mark.number, last_->utime, mark.utime,
                           mark.restart,
                           silence < 0 ? Break::Verdict::step : Break::Verdict::unknown});
      }
      if (silence >= 0) {
        total_ += static_cast<double>(silence);
        ++silences_;
        if (silence <= shortest_silence) longest_ = std::max(longest_, silence);
      }
    }
    if (!mark.beat.empty()) take_beat(mark.beat);
    last_ = mark;
  }

  /// How much time passed over the silences since the sender's last heartbeat.
  void take_beat(Bytes bytes) {
    const heartbeat_t* beat = heartbeat_.decode(bytes);
    if (beat == nullptr) return;
    Beat& last = beats_[{beat->session, beat->node}];
    const Beat now{beat->seq, total_, breaks_.size()};
    const double count = static_cast<double>(beat->seq) - static_cast<double>(last.seq);
    if (last.seq != 0 && count > 0) {
      double open = 0;
      double steps = 0;
      for (std::size_t i = last.breaks; i < breaks_.size(); ++i) {
        const auto silence = static_cast<double>(breaks_[i].silence());
        if (silence <= 0) continue;
        if (breaks_[i].verdict == Break::Verdict::unknown) open += silence;
        if (breaks_[i].verdict == Break::Verdict::step) steps += silence;
      }
      const double beaten = count * static_cast<double>(beat_period);
      const double passed = total_ - last.total - steps;
      const bool step = std::abs(passed - open - beaten) < std::abs(passed - beaten);
      for (std::size_t i = last.breaks; open > 0 && i < breaks_.size(); ++i) {
        if (breaks_[i].verdict != Break::Verdict::unknown) continue;
        breaks_[i].verdict = step ? Break::Verdict::step : Break::Verdict::time_passed;
      }
    }
    last = now;
  }

  /// The longest silences without another explanation, all at once: two steps of one size must not
  /// excuse each other.
  void judge_unexplained() {
    std::vector<Break*> open;
    double total = total_;
    auto silences = static_cast<double>(silences_);
    for (Break& b : breaks_) {
      if (b.verdict == Break::Verdict::unknown && !b.joined) open.push_back(&b);
      if (b.silence() < 0 || (b.verdict != Break::Verdict::step && !b.joined)) continue;
      total -= static_cast<double>(b.silence());
      --silences;
    }
    std::sort(open.begin(), open.end(),
              [](const Break* a, const Break* b) { return a->silence() > b->silence(); });
    open.resize(std::min(open.size(), max_unexplained + 1));
    std::vector<double> rest;  // all that is shorter
    for (const Break* b : open) {
      total -= static_cast<double>(b->silence());
      rest.push_back(std::max(total, 0.0));
    }
    for (std::size_t k = std::min(open.size(), max_unexplained); k-- > 0;) {
      const auto silence = static_cast<double>(open[k]->silence());
      const double n = silences - static_cast<double>(k);
      const double others = rest[k] / (silence + rest[k]);
      if (open[k]->silence() < max_wait || others >= 0.5) continue;
      if (n * std::pow(others, n - 1) >= p_value) continue;
      for (std::size_t i = 0; i <= k; ++i) open[i]->verdict = Break::Verdict::step;
      return;
    }
  }

  void judge_joints() {
    Utime longest = longest_;
    for (const Break& b : breaks_) {
      if (!b.joined && b.verdict != Break::Verdict::step) longest = std::max(longest, b.silence());
    }
    for (Break& b : breaks_) {
      if (b.joined && b.silence() > longest) b.verdict = Break::Verdict::step;
    }
  }

  void place_stretches() {
    timeline_.stretches_.push_back({0, first_, 0, 0});
    for (const Break& b : breaks_) {
      if (b.verdict != Break::Verdict::step) continue;
      auto& open = timeline_.stretches_.back();
      open.last = b.before;
      const Utime position = later(open.position, elapsed(open.first, open.last));
      timeline_.stretches_.push_back({b.place, b.after, 0, position});
      if (std::abs(static_cast<double>(b.silence())) < static_cast<double>(min_step)) continue;
      const auto kind = b.joined          ? TimeStep::Kind::joined
                        : b.silence() < 0 ? TimeStep::Kind::back
                                          : TimeStep::Kind::ahead;
      timeline_.steps_.push_back({kind, b.offset, b.number, b.before, b.after, position});
    }
    timeline_.stretches_.back().last = last_->utime;
  }

  struct Beat {
    std::int64_t seq = 0;
    double total = 0;
    std::size_t breaks = 0;
  };

  Timeline& timeline_;
  std::int64_t places_ = 0;
  std::optional<Mark> last_;  ///< that stands at its time
  std::optional<Mark> next_;
  bool restart_ = false;  ///< of an event that did not stand at its time
  Utime first_ = 0;
  std::vector<Break> breaks_;
  double total_ = 0;  ///< of all silences, us
  std::int64_t silences_ = 0;
  Utime longest_ = 0;
  ReusedMessage<heartbeat_t> heartbeat_;
  std::map<std::pair<std::int64_t, std::string>, Beat> beats_;
};

Timeline::Timeline(LogReader& reader) {
  TimelineFinder finder(*this);
  LogEvent event;
  while (reader.next(event)) {
    finder.take(event, reader.step() == SequenceCounter::Step::restart);
  }
  finder.finish();
  reader.rewind();
}

Utime Timeline::duration() const {
  if (empty()) return 0;
  const Stretch& s = stretches_.back();
  return later(s.position, elapsed(s.first, s.last));
}

Utime Timeline::first_position_of(Utime received) const {
  for (const Stretch& s : stretches_) {
    if (s.last < received) continue;
    return later(s.position, std::max<Utime>(0, elapsed(s.first, received)));
  }
  return later(duration(), 1);
}

Utime Timeline::last_position_of(Utime received) const {
  for (auto s = stretches_.rbegin(); s != stretches_.rend(); ++s) {
    if (s->first <= received) {
      return later(s->position, elapsed(s->first, std::min(received, s->last)));
    }
  }
  return -1;
}

Utime Timeline::Walker::position(Utime received) {
  ++place_;
  const auto& stretches = timeline_.stretches_;
  const auto& strays = timeline_.strays_;
  if (stretch_ + 1 < stretches.size() && stretches[stretch_ + 1].place == place_) ++stretch_;
  if (stray_ < strays.size() && strays[stray_] == place_) {
    ++stray_;
    return position_;
  }
  const Timeline::Stretch& s = stretches[stretch_];
  position_ = std::max(position_, later(s.position, elapsed(s.first, received)));
  return position_;
}

Utime Timeline::Walker::time(Utime received) {
  return later(timeline_.start(), position(received));
}

std::string TimeStep::text() const {
  const Utime by = elapsed(before, after);
  const std::string much = fixed(std::abs(static_cast<double>(by)) / second, 3) + " s";
  const std::string where =
      "at " + fixed(seconds(position), 3) + " s, event " + std::to_string(event) + ": ";
  switch (kind) {
    case Kind::back:
      return where + "the clock was set back by " + much;
    case Kind::ahead:
      return where + "times go ahead by " + much + " while no time was recorded";
    case Kind::joined:
      return where + "another recording follows, " + much + (by < 0 ? " earlier" : " later");
  }
  return where;
}

}  // namespace berth::logs
