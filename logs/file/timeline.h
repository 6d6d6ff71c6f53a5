// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "logs/file/log_reader.h"

namespace berth::logs {

/// A place where a log's times jump although no time has passed.
struct TimeStep {
  enum class Kind {
    back,    ///< the clock was set back
    ahead,   ///< the clock was set ahead, or nothing was recorded for so long
    joined,  ///< event numbers begin anew: another recording was joined to the first
  };
  Kind kind = Kind::back;
  std::size_t offset = 0;  ///< in the file, of the first event after it
  std::int64_t event = 0;  ///< its number
  Utime before = 0;        ///< at which the last event before it was received
  Utime after = 0;         ///< at which the first event after it was received
  Utime position = 0;      ///< on the timeline

  /// "at 12.345 s, event 617: the clock is set back by 30.000 s".
  std::string text() const;
};

/// One time for a whole log: how long after the log's first event each of its events was received,
/// though the clock was set in between, or logs were joined. Never goes back. A log whose clock was
/// left alone has the times that it was received at.
///
/// One gap does not determine whether the clock was set. Times that go back, and stay, are a step.
/// A silence of more than a second is one
///  - where heartbeats show it: they count 50 ms each, whatever the clock does, and go on across it
///    as if it had not been; where as many of them are missing as fit into it, time did pass;
///  - where event numbers begin anew and it is longer than any silence within the recordings;
///  - where neither decides, when it lasts over a minute (a replay may wait for shorter ones), and
///    random events, as many in as much time as all others, leave such a silence in less than one
///    log of 1e9 (that the longest of n spacings is more than half of their sum, the share x of it,
///    has the probability n (1 - x)^(n - 1): R. A. Fisher, Tests of significance in harmonic
///    analysis, 1929).
/// A single event at another time than its neighbours (its header is damaged, it comes late) is no
/// step: it has the time of the one before.
class Timeline {
 public:
  /// Reads the log once, and rewinds it.
  explicit Timeline(LogReader& reader);

  /// The steps of interest to a user: ntpd and its like correct less than 128 ms without one.
  const std::vector<TimeStep>& steps() const { return steps_; }
  /// There is no event.
  bool empty() const { return stretches_.empty(); }
  /// At which the first event was received.
  Utime start() const { return empty() ? 0 : stretches_.front().first; }
  /// From the first event to the last.
  Utime duration() const;

  /// The place of a time of the log's clock, which has been there more than once when it was set
  /// back: the first such place, or the last. Times at which nothing was recorded are those of the
  /// event that comes next, or before; -1 is before the log, duration() + 1 after it.
  Utime first_position_of(Utime received) const;
  Utime last_position_of(Utime received) const;

  /// Goes along the log with its reader.
  class Walker {
   public:
    explicit Walker(const Timeline& timeline) : timeline_(timeline) {}
    /// Call it once for every event, in the order of the file. @return us after the first event
    Utime position(Utime received);
    /// The same, after start().
    Utime time(Utime received);

   private:
    const Timeline& timeline_;
    std::int64_t place_ = -1;
    std::size_t stretch_ = 0;
    std::size_t stray_ = 0;
    Utime position_ = 0;
  };

 private:
  friend class TimelineFinder;
  /// From one step, of any size, to the next.
  struct Stretch {
    std::int64_t place = 0;  ///< events before it
    Utime first = 0;         ///< received
    Utime last = 0;          ///< received
    Utime position = 0;      ///< of first
  };

  std::vector<TimeStep> steps_;
  std::vector<Stretch> stretches_;
  std::vector<std::int64_t> strays_;  ///< their places: they are later than those that follow
};

/// Time between two times, and the time after a duration; sums do not overflow.
Utime elapsed(Utime from, Utime to);
Utime later(Utime time, Utime by);

}  // namespace berth::logs
