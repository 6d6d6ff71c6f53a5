// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/log_index.h"

#include <algorithm>
#include <berth/heartbeat_t.hpp>

#include "lcmtypes/channels.h"

namespace berth {

LogIndex::LogIndex(const std::filesystem::path& log, const std::function<void(double)>& share_done)
    : reader_(log), timeline_(reader_) {
  logs::Timeline::Walker times(timeline_);
  logs::LogEvent event;
  std::size_t read = 0;
  while (reader_.next(event)) {
    entries_.push_back({times.time(event.utime), event.data.data(),
                        static_cast<std::uint32_t>(event.data.size()),
                        channel_number(event.channel)});
    if (const auto beat = logs::decode<heartbeat_t>(event, channels::heartbeat)) {
      sessions_.insert(beat->session);
    }
    read += logs::format::header_bytes + event.channel.size() + event.data.size();
    if (share_done && entries_.size() % 4096 == 0) {
      share_done(static_cast<double>(read) / static_cast<double>(reader_.size()));
    }
  }
}

std::uint32_t LogIndex::channel_number(std::string_view name) {
  const auto found = numbers_.find(name);
  if (found != numbers_.end()) return found->second;
  const auto number = static_cast<std::uint32_t>(names_.size());
  names_.push_back(numbers_.emplace(name, number).first->first);
  return number;
}

logs::LogEvent LogIndex::at(std::size_t place) const {
  const Entry& entry = entries_[place];
  logs::LogEvent event;
  event.number = static_cast<std::int64_t>(place);
  event.utime = entry.utime;
  event.channel = names_[entry.channel];
  event.data = {entry.data, entry.bytes};
  return event;
}

std::size_t LogIndex::not_before(Utime utime) const {
  const auto found = std::lower_bound(entries_.begin(), entries_.end(), utime,
                                      [](const Entry& entry, Utime t) { return entry.utime < t; });
  return static_cast<std::size_t>(found - entries_.begin());
}

std::size_t LogIndex::next_of(const std::string& channel, std::size_t place) const {
  const auto number = numbers_.find(channel);
  if (number == numbers_.end()) return size();
  while (place < size() && entries_[place].channel != number->second) ++place;
  return place;
}

}  // namespace berth
