// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "logs/file/log_reader.h"
#include "logs/file/timeline.h"
#include "logs/inspect/channel_tally.h"

namespace berth::logs {

/// One irregular place in a log.
struct Finding {
  enum class Kind {
    damage,          ///< bytes that belong to no event
    missing_events,  ///< a jump in the logger's own numbers: a part of the file is gone
    odd_number,      ///< an event number, or a seq, that cannot be right
    restart,         ///< event numbers, or a seq, begin anew: logs joined, a node started: no fault
    undecodable,     ///< not a message of its channel's type
    gap,             ///< a jump in a channel's seq: messages that never came to the logger
    step,            ///< the clock was set, or another recording joined: no fault
  };
  Kind kind = Kind::damage;
  std::size_t offset = 0;   ///< in the file
  std::int64_t event = -1;  ///< its number; of damage: of the last good one before; -1: none
  Utime utime = 0;          ///< at which that was received
  std::string channel;      ///< empty: of the file as such
  std::int64_t count = 0;   ///< bytes of damage, messages missing, us of a step
  std::string detail = {};  ///< of a step

  std::string text() const;
};

/// A log read once from end to end.
struct Inspection {
  std::filesystem::path file;
  std::size_t size = 0;  ///< bytes
  std::int64_t events = 0;
  Utime first = 0;     ///< at which the first event was received
  Utime last = 0;      ///< the last one
  Utime duration = 0;  ///< on the log's timeline: without the steps of its clock
  std::size_t steps = 0;
  std::int64_t missing_events = 0;
  std::size_t damaged_bytes = 0;
  std::size_t damaged_places = 0;
  std::int64_t backwards = 0;  ///< events received before the one that stands in front of them
  std::map<std::string, ChannelTally> channels;   ///< their times are those of the timeline
  std::map<std::int64_t, std::int64_t> sessions;  ///< messages of each
  std::vector<Finding> findings;                  ///< in the file's order; of each kind and channel
                                                  ///< the first hundred

  double duration_s() const { return seconds(duration); }
  std::int64_t undecodable() const;
  std::int64_t unknown() const;
  std::int64_t missing_messages() const;
  /// There are messages, no damage, nothing undecodable, and no gaps either unless these are
  /// allowed.
  bool sound(bool gaps_count = true) const;
};

/// Reads a log, checking every message's lengths. progress: called with 0..1 now and then.
/// types must outlive what comes back.
/// @throws InputError when the file cannot be read.
Inspection inspect(const std::filesystem::path& log, const TypeCatalogue& types,
                   const std::function<void(double)>& progress = nullptr);

/// One line: damage, undecodable, missing.
std::string summary_of(const Inspection& inspection);
/// For people and for programs. The table has a line for each channel.
std::string text_of(const Inspection& inspection);
nlohmann::ordered_json json_of(const Inspection& inspection);

}  // namespace berth::logs
