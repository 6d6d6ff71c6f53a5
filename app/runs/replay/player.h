// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "logs/file/log_reader.h"
#include "logs/file/timeline.h"

namespace berth {

/// Where every good event of a log is, made in one pass over it: seeking is then at once, in a log
/// of any size. Holds 24 bytes an event; the events themselves stay in the file.
class LogIndex {
 public:
  /// @param share_done receives how much of the file was read, 0 to 1
  /// @throws InputError when the file cannot be read
  explicit LogIndex(const std::filesystem::path& log,
                    const std::function<void(double)>& share_done = {});

  std::size_t size() const { return entries_.size(); }
  bool empty() const { return entries_.empty(); }
  /// @pre place < size()
  logs::LogEvent at(std::size_t place) const;
  /// When it is played: as the logger received it, on the log's timeline.
  Utime time(std::size_t place) const { return entries_[place].utime; }
  Utime first() const { return empty() ? 0 : time(0); }
  Utime last() const { return empty() ? 0 : time(size() - 1); }
  /// The first event not before this time; size() when there is none.
  std::size_t not_before(Utime utime) const;
  /// The first event of this channel at this place or after it; size() when there is none.
  std::size_t next_of(const std::string& channel, std::size_t place) const;

  /// Of the heartbeats in the log.
  const std::set<std::int64_t>& sessions() const { return sessions_; }
  const std::vector<logs::TimeStep>& steps() const { return timeline_.steps(); }
  std::size_t damaged_bytes() const { return reader_.damaged_bytes(); }

 private:
  struct Entry {
    Utime utime;
    const std::uint8_t* data;
    std::uint32_t bytes;
    std::uint32_t channel;
  };

  std::uint32_t channel_number(std::string_view name);

  logs::LogReader reader_;
  logs::Timeline timeline_;
  std::vector<Entry> entries_;
  std::map<std::string, std::uint32_t, std::less<>> numbers_;
  std::vector<std::string_view> names_;  // into numbers_
  std::set<std::int64_t> sessions_;
};

struct PlayerOptions {
  Utime from = 0;  ///< after the log's first event
  Utime to = 0;    ///< after the log's first event; 0: to its end
  double rate = 1;
  bool loop = false;
};

/// Plays the events of a log at the times at which they were recorded, from each other; late is
/// made up for, nothing drifts. Knows no clock: wall times are those of any clock in us.
class Player {
 public:
  using Emit = std::function<void(const logs::LogEvent&)>;
  /// Receives a jump: what comes next does not follow what came last.
  using Jumped = std::function<void(std::size_t place)>;

  Player(const LogIndex& index, const PlayerOptions& options, Emit emit, Jumped jumped = {});

  /// Begins to play at this wall time.
  void start(Utime wall);
  /// Emits everything that is due.
  void run(Utime wall);
  /// When run() has something to do next; nothing while it pauses or when the end is reached.
  std::optional<Utime> next_due() const;
  /// The end is reached and there is no loop.
  bool finished() const;

  void pause_or_go(Utime wall);
  /// Pauses, and emits one event.
  void step(Utime wall);
  /// Pauses, and emits all up to the next one of a channel, and that one.
  void step_to(const std::string& channel, Utime wall);
  /// Goes on from so much later or earlier in the log; what lies between is not emitted.
  void seek(Utime by, Utime wall);
  void change_rate(double factor, Utime wall);
  void loop_or_not() { options_.loop = !options_.loop; }

  bool paused() const { return paused_; }
  double rate() const { return options_.rate; }
  bool loops() const { return options_.loop; }
  /// The place in the log, after its first event.
  Utime position(Utime wall) const { return log_time(wall) - index_.first(); }
  /// Of the log, to the next event; nothing at the end.
  std::optional<Utime> until_next(Utime wall) const;

 private:
  Utime log_time(Utime wall) const;
  Utime wall_time(Utime log) const;
  void anchor(Utime log, Utime wall);
  void emit_next();
  void jump_to(Utime log, Utime wall);

  const LogIndex& index_;
  PlayerOptions options_;
  Emit emit_;
  Jumped jumped_;
  std::size_t begin_;
  std::size_t end_;
  std::size_t next_;
  bool paused_ = true;
  Utime anchor_log_;       // this place in the log is played
  Utime anchor_wall_ = 0;  // at this time
};

}  // namespace berth
