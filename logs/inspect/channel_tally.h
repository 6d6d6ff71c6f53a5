// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/bus.h"
#include "common/bus/loop.h"
#include "logs/file/sequence_counter.h"
#include "logs/types/type_catalogue.h"

namespace berth::logs {

/// Fields of a type that reveal a stream's gaps, when all before it has a fixed size: seq, and
/// besides session and sender (node or commander), which have counts of their own.
struct StreamFields {
  struct Place {
    std::size_t offset;  ///< in the message, fingerprint included
    Kind kind;
  };
  std::optional<Place> seq;
  std::optional<Place> session;
  std::optional<Place> sender;

  static StreamFields of(const StructType& type);
  /// Seq and sender of a sound message, session left out; empty when the type has no seq.
  std::string key_of(Bytes message) const;
};

/// Traffic of one channel: counts, sizes, pauses, types, gaps. Allocates nothing per message.
class ChannelTally {
 public:
  explicit ChannelTally(const TypeCatalogue& types) : types_(&types) {}

  /// Result of one message.
  struct Note {
    enum class Kind { sound, unknown_type, undecodable };
    Kind kind = Kind::sound;
    SequenceCounter::Step step = SequenceCounter::Step::next;
    std::int64_t missing = 0;  ///< Step::gap: messages left out before this one
    std::size_t stream = 0;    ///< of which the step is
  };
  Note take(Utime utime, Bytes message);

  struct TypeCount {
    std::uint64_t fingerprint = 0;
    const StructType* type = nullptr;  ///< null: unknown
    StreamFields places;
    std::int64_t messages = 0;
  };
  struct SessionCount {
    std::int64_t session = 0;
    std::int64_t messages = 0;
  };

  std::int64_t messages() const { return messages_; }
  std::size_t bytes() const { return bytes_; }
  std::size_t smallest() const { return smallest_; }
  std::size_t largest() const { return largest_; }
  Utime first() const { return first_; }
  Utime last() const { return last_; }
  Utime max_pause() const { return max_pause_; }
  double rate_hz() const;  ///< mean from the first to the last message; 0 for fewer than two

  /// The most frequent known type; null when all are unknown.
  const StructType* type() const;
  const std::vector<TypeCount>& types() const { return counts_; }
  const std::vector<SessionCount>& sessions() const { return sessions_; }
  /// By the messages' own seq, over all streams.
  std::int64_t missing() const;
  std::int64_t restarts() const { return restarts_; }
  /// Messages that do not belong to their channel: of a known type but damaged, or with an unknown
  /// fingerprint on a channel whose type is known.
  std::int64_t undecodable() const;
  /// On a channel of which no type is known.
  std::int64_t unknown() const;

 private:
  struct Stream {
    std::int64_t session;
    std::string sender;
    SequenceCounter counter;
  };

  TypeCount& count_of(std::uint64_t fingerprint);
  void count_session(std::int64_t session);
  std::size_t stream_of(std::int64_t session, std::string_view sender);

  const TypeCatalogue* types_;
  std::int64_t messages_ = 0;
  std::size_t bytes_ = 0;
  std::size_t smallest_ = 0;
  std::size_t largest_ = 0;
  Utime first_ = 0;
  Utime last_ = 0;
  Utime max_pause_ = 0;
  std::vector<TypeCount> counts_;
  std::size_t last_count_ = 0;
  std::vector<SessionCount> sessions_;
  std::size_t last_session_ = 0;
  std::vector<Stream> streams_;
  std::size_t last_stream_ = 0;
  std::int64_t damaged_ = 0;
  std::int64_t restarts_ = 0;
};

}  // namespace berth::logs
