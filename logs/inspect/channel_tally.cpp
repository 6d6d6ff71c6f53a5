// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/channel_tally.h"

#include <algorithm>

#include "logs/types/lcm_type.h"
#include "logs/types/value.h"

namespace berth::logs {
namespace {

constexpr std::size_t max_kept = 256;  // types, sessions, streams; damage makes them up

bool fits(Bytes message, const StreamFields::Place& place) {
  return place.offset + wire::bytes_of(place.kind).value_or(4) <= message.size();
}

std::int64_t integer_at(Bytes message, const StreamFields::Place& place) {
  return wire::integer_of(place.kind, message.data() + place.offset);
}

std::string_view text_at(Bytes message, const StreamFields::Place& place) {
  const std::int64_t length = wire::signed_of<4>(message.data() + place.offset);
  const auto* text = reinterpret_cast<const char*>(message.data() + place.offset + 4);
  return {text, static_cast<std::size_t>(std::max<std::int64_t>(length - 1, 0))};
}

}  // namespace

StreamFields StreamFields::of(const StructType& type) {
  StreamFields places;
  std::size_t offset = 8;
  for (const Field& field : type.fields) {
    const bool integer = field.kind <= Kind::int64 && field.dimensions.empty();
    if (field.name == "seq" && integer) places.seq = {offset, field.kind};
    if (field.name == "session" && integer) places.session = {offset, field.kind};
    if (field.kind == Kind::text && field.dimensions.empty() && !places.sender &&
        (field.name == "node" || field.name == "commander")) {
      places.sender = {offset, field.kind};
    }
    const auto bytes = wire::bytes_of(field.kind);
    if (!bytes) break;
    std::size_t count = 1;
    for (const Dimension& d : field.dimensions) {
      if (d.count_field >= 0) return places;
      count *= static_cast<std::size_t>(d.length);
    }
    offset += count * *bytes;
  }
  return places;
}

std::string StreamFields::key_of(Bytes message) const {
  if (!seq || !fits(message, *seq)) return "";
  std::string key = std::to_string(integer_at(message, *seq));
  if (sender && fits(message, *sender)) {
    const std::string_view name = text_at(message, *sender);
    const auto* end = reinterpret_cast<const char*>(message.data() + message.size());
    if (name.data() + name.size() < end) key.append(" ").append(name);
  }
  return key;
}

ChannelTally::Note ChannelTally::take(Utime utime, Bytes message) {
  if (messages_ == 0) {
    first_ = utime;
    smallest_ = message.size();
  } else {
    max_pause_ = std::max(max_pause_, utime - last_);
  }
  last_ = utime;
  ++messages_;
  bytes_ += message.size();
  smallest_ = std::min(smallest_, message.size());
  largest_ = std::max(largest_, message.size());

  Note note;
  TypeCount& count = count_of(fingerprint_of(message));
  ++count.messages;
  if (count.type == nullptr) {
    note.kind = Note::Kind::unknown_type;
    return note;
  }
  if (!is_message(*count.type, message)) {
    ++damaged_;
    note.kind = Note::Kind::undecodable;
    return note;
  }
  const StreamFields& places = count.places;
  std::int64_t session = 0;
  if (places.session && fits(message, *places.session)) {
    session = integer_at(message, *places.session);
    count_session(session);
  }
  if (!places.seq || !fits(message, *places.seq)) return note;
  const std::string_view sender =
      places.sender && fits(message, *places.sender) ? text_at(message, *places.sender) : "";
  note.stream = stream_of(session, sender);
  if (note.stream == streams_.size()) return note;
  SequenceCounter& counter = streams_[note.stream].counter;
  note.step = counter.take(integer_at(message, *places.seq));
  if (note.step == SequenceCounter::Step::gap) note.missing = counter.missing_before();
  if (note.step == SequenceCounter::Step::restart) ++restarts_;
  return note;
}

ChannelTally::TypeCount& ChannelTally::count_of(std::uint64_t fingerprint) {
  if (last_count_ < counts_.size() && counts_[last_count_].fingerprint == fingerprint) {
    return counts_[last_count_];
  }
  const auto found = std::find_if(counts_.begin(), counts_.end(),
                                  [&](const TypeCount& c) { return c.fingerprint == fingerprint; });
  if (found == counts_.end()) {
    const StructType* type = types_->by_fingerprint(fingerprint);
    if (counts_.size() >= max_kept && type == nullptr) return counts_.back();
    counts_.push_back(
        {fingerprint, type, type == nullptr ? StreamFields() : StreamFields::of(*type)});
    last_count_ = counts_.size() - 1;
  } else {
    last_count_ = static_cast<std::size_t>(found - counts_.begin());
  }
  return counts_[last_count_];
}

void ChannelTally::count_session(std::int64_t session) {
  if (last_session_ >= sessions_.size() || sessions_[last_session_].session != session) {
    const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                    [&](const SessionCount& c) { return c.session == session; });
    last_session_ = static_cast<std::size_t>(found - sessions_.begin());
    if (found == sessions_.end()) {
      if (sessions_.size() >= max_kept) return;
      sessions_.push_back({session, 0});
    }
  }
  ++sessions_[last_session_].messages;
}

/// @return streams_.size() when there are too many to follow.
std::size_t ChannelTally::stream_of(std::int64_t session, std::string_view sender) {
  const auto is = [&](const Stream& s) { return s.session == session && s.sender == sender; };
  if (last_stream_ < streams_.size() && is(streams_[last_stream_])) return last_stream_;
  const auto found = std::find_if(streams_.begin(), streams_.end(), is);
  const auto index = static_cast<std::size_t>(found - streams_.begin());
  if (found == streams_.end()) {
    if (streams_.size() >= max_kept) return streams_.size();
    streams_.push_back({session, std::string(sender), {}});
  }
  last_stream_ = index;
  return index;
}

double ChannelTally::rate_hz() const {
  return messages_ < 2 || last_ <= first_
             ? 0
             : static_cast<double>(messages_ - 1) / seconds(last_ - first_);
}

const StructType* ChannelTally::type() const {
  const TypeCount* dominant = nullptr;
  for (const TypeCount& c : counts_) {
    if (c.type != nullptr && (dominant == nullptr || c.messages > dominant->messages))
      dominant = &c;
  }
  return dominant == nullptr ? nullptr : dominant->type;
}

std::int64_t ChannelTally::missing() const {
  std::int64_t sum = 0;
  for (const Stream& s : streams_) sum += s.counter.missing();
  return sum;
}

std::int64_t ChannelTally::undecodable() const {
  std::int64_t sum = damaged_;
  if (type() == nullptr) return sum;
  for (const TypeCount& c : counts_) sum += c.type == nullptr ? c.messages : 0;
  return sum;
}

std::int64_t ChannelTally::unknown() const { return type() == nullptr ? messages_ - damaged_ : 0; }

}  // namespace berth::logs
