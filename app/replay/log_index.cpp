// SPDX-License-Identifier: BSD-3-Clause
#include "app/replay/log_index.h"

#include <algorithm>
#include <berth/heartbeat_t.hpp>

#include "lcmtypes/channels.h"

namespace berth {

LogIndex::LogIndex(const std::filesystem::path& log, const std::function<void(double)>& share_done)
    : reader_(log) {
  logs::LogEvent event;
  std::size_t read = 0;
  while (reader_.next(event)) {
    entries_.push_back({event.utime, event.data.data(),
                        static_cast<std::uint32_t>(event.data.size()),
                        channel_number(event.channel)});
    if (event.channel == channels::heartbeat) {
      if (const auto beat = logs::decode<heartbeat_t>(event.data)) sessions_.insert(beat->session);
    }
    read += logs::format::header_bytes + event.channel.size() + event.data.size();
    if (share_done && entries_.size() % 4096 == 0) {
      share_done(static_cast<double>(read) / static_cast<double>(reader_.size()));
    }
  }
  mend_times();
}

std::uint32_t LogIndex::channel_number(std::string_view name) {
  const auto found = numbers_.find(name);
  if (found != numbers_.end()) return found->second;
  const auto number = static_cast<std::uint32_t>(names_.size());
  names_.push_back(numbers_.emplace(name, number).first->first);
  return number;
}

void LogIndex::mend_times() {
  const std::size_t n = entries_.size();
  if (n < 2) return;
  // At the ends a time far from its only neighbour is made up.
  constexpr Utime far = 3600 * second;
  if (std::abs(entries_[1].utime - entries_[0].utime) > far) entries_[0].utime = entries_[1].utime;
  if (entries_[n - 1].utime - entries_[n - 2].utime > far) {
    entries_[n - 1].utime = entries_[n - 2].utime;
  }
  // Between them the middle one of three neighbours passes over a single wrong time.
  Utime before = entries_[0].utime;
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const Utime own = entries_[i].utime;
    const Utime after = entries_[i + 1].utime;
    entries_[i].utime = std::max(std::min(before, own), std::min(std::max(before, own), after));
    before = own;
  }
  for (std::size_t i = 1; i < n; ++i) {
    entries_[i].utime = std::max(entries_[i].utime, entries_[i - 1].utime);
  }
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
