// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/player.h"

#include <algorithm>
#include <berth/heartbeat_t.hpp>
#include <cmath>

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

Player::Player(const LogIndex& index, const PlayerOptions& options, Emit emit, Jumped jumped)
    : index_(index),
      options_(options),
      emit_(std::move(emit)),
      jumped_(std::move(jumped)),
      begin_(index.not_before(index.first() + options.from)),
      end_(options.to == 0 ? index.size() : index.not_before(index.first() + options.to)),
      next_(begin_),
      anchor_log_(index.first() + options.from) {
  end_ = std::max(begin_, end_);
}

void Player::start(Utime wall) {
  paused_ = false;
  anchor_wall_ = wall;
}

Utime Player::log_time(Utime wall) const {
  if (paused_) return anchor_log_;
  const Utime played =
      static_cast<Utime>(std::floor(static_cast<double>(wall - anchor_wall_) * options_.rate));
  if (next_ < end_) return anchor_log_ + played;
  const Utime last = end_ > begin_ ? index_.time(end_ - 1) : anchor_log_;
  return std::max(anchor_log_, std::min(anchor_log_ + played, last));
}

Utime Player::wall_time(Utime log) const {
  return anchor_wall_ +
         static_cast<Utime>(std::ceil(static_cast<double>(log - anchor_log_) / options_.rate));
}

void Player::anchor(Utime log, Utime wall) {
  anchor_log_ = log;
  anchor_wall_ = wall;
}

void Player::emit_next() { emit_(index_.at(next_++)); }

void Player::run(Utime wall) {
  if (paused_) return;
  const Utime until = log_time(wall);
  while (next_ < end_ && index_.time(next_) <= until) emit_next();
  if (next_ < end_ || !options_.loop || begin_ == end_) return;
  // Around: the first event follows the last one at once.
  jump_to(index_.time(begin_), wall);
}

std::optional<Utime> Player::next_due() const {
  if (paused_ || next_ >= end_) return std::nullopt;
  return wall_time(index_.time(next_));
}

bool Player::finished() const { return next_ >= end_ && !paused_ && !options_.loop; }

void Player::pause_or_go(Utime wall) {
  anchor(log_time(wall), wall);
  paused_ = !paused_;
}

void Player::step(Utime wall) {
  if (!paused_) pause_or_go(wall);
  if (next_ >= end_) return;
  anchor(index_.time(next_), wall);
  emit_next();
}

void Player::step_to(const std::string& channel, Utime wall) {
  if (!paused_) pause_or_go(wall);
  const std::size_t found = std::min(index_.next_of(channel, next_), end_ - (end_ > 0 ? 1 : 0));
  while (next_ <= found && next_ < end_) step(wall);
}

void Player::jump_to(Utime log, Utime wall) {
  anchor(log, wall);
  next_ = std::clamp(index_.not_before(log), begin_, end_);
  if (jumped_) jumped_(next_);
}

void Player::seek(Utime by, Utime wall) {
  if (begin_ == end_) return;
  jump_to(std::clamp(log_time(wall) + by, index_.time(begin_), index_.time(end_ - 1)), wall);
}

void Player::change_rate(double factor, Utime wall) {
  constexpr double slowest = 1.0 / 64;
  constexpr double fastest = 1024;
  anchor(log_time(wall), wall);
  options_.rate = std::clamp(options_.rate * factor, slowest, fastest);
}

std::optional<Utime> Player::until_next(Utime wall) const {
  if (next_ >= end_) return std::nullopt;
  return std::max<Utime>(0, index_.time(next_) - log_time(wall));
}

}  // namespace berth
