// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

#include "logs/file/log_event.h"
#include "logs/file/sequence_counter.h"

namespace berth::logs {

/// Bytes of a log that belong to no good event.
struct Damage {
  std::size_t offset = 0;
  std::size_t bytes = 0;
  std::int64_t after_event = -1;  ///< number of the last good event before it; -1: there was none
  Utime after_utime = 0;          ///< at which that was received
};

/// Reads a log from end to end, past any damage: after a broken header or length it goes on at the
/// next good event. A tail cut off by a crash is damage too. Never throws once the file is open.
class LogReader {
 public:
  /// @throws InputError when the file cannot be read.
  explicit LogReader(const std::filesystem::path& path);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  /// The next good event. @return false at the end.
  bool next(LogEvent& event);
  /// Starts again.
  void rewind();

  /// Of what was read so far.
  std::int64_t events() const { return events_; }
  /// Jumps in the event numbers.
  std::int64_t missing_events() const { return numbers_.missing(); }
  /// How the last event's number follows the one before.
  SequenceCounter::Step step() const { return step_; }
  std::int64_t missing_before() const { return numbers_.missing_before(); }
  std::size_t damaged_bytes() const;
  const std::vector<Damage>& damage() const { return damage_; }
  std::size_t size() const { return size_; }
  /// Bytes read so far.
  std::size_t position() const { return at_; }

 private:
  bool header_at(std::size_t at, LogEvent& event, std::size_t& end) const;
  bool sync_at(std::size_t at) const;
  std::size_t next_event_after(std::size_t at, std::size_t limit) const;
  void skip_to(std::size_t at);

  const std::uint8_t* data_ = nullptr;
  std::size_t size_ = 0;
  std::size_t at_ = 0;
  std::int64_t events_ = 0;
  SequenceCounter numbers_;
  SequenceCounter::Step step_ = SequenceCounter::Step::next;
  Utime last_utime_ = 0;
  std::vector<Damage> damage_;
};

}  // namespace berth::logs
