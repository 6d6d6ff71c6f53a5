// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <map>
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

}  // namespace berth
