// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/repair.h"

#include <map>
#include <string>
#include <unordered_map>

#include "logs/file/log_writer.h"
#include "logs/types/value.h"

namespace berth::logs {
namespace {

/// The types on a log's channels: the count of each fingerprint, and whether its type is known.
class ChannelContents {
 public:
  ChannelContents(const std::filesystem::path& log, const TypeCatalogue& types) : types_(types) {
    LogReader reader(log);
    LogEvent event;
    while (reader.next(event)) {
      Channel& channel = of(event);
      if (types.type_of(event.data) != nullptr) {
        channel.known = true;
      } else {
        ++channel.unknown[fingerprint_of(event.data)];
      }
    }
  }

  /// No damage: a message of its type, or of an unknown one. A fingerprint that is
  /// there but once, where others are known, is a damaged one.
  bool is_whole(const LogEvent& event) {
    if (const StructType* type = types_.type_of(event.data)) return is_message(*type, event.data);
    const Channel& channel = of(event);
    return !channel.known || channel.unknown.at(fingerprint_of(event.data)) > 1;
  }

 private:
  struct Channel {
    bool known = false;
    std::unordered_map<std::uint64_t, std::int64_t> unknown;
  };

  Channel& of(const LogEvent& event) {
    const auto found = channels_.find(event.channel);
    return found != channels_.end() ? found->second : channels_[std::string(event.channel)];
  }

  const TypeCatalogue& types_;
  std::map<std::string, Channel, std::less<>> channels_;
};

}  // namespace

Repair repair(const std::filesystem::path& in, const std::filesystem::path& out,
              const TypeCatalogue& types) {
  constexpr std::int64_t max_findings = 100;
  ChannelContents channels(in, types);
  LogReader reader(in);
  DerivedLog log(out);
  Repair result;
  LogEvent event;
  while (reader.next(event)) {
    if (!channels.is_whole(event)) {
      if (result.dropped++ < max_findings) {
        result.findings.push_back({Finding::Kind::undecodable, event.offset, event.number,
                                   event.utime, std::string(event.channel), 1});
      }
    } else {
      log.writer().copy(event);
      ++result.written;
    }
  }
  for (const Damage& d : reader.damage()) {
    result.findings.push_back({Finding::Kind::damage, d.offset, d.after_event, d.after_utime, "",
                               static_cast<std::int64_t>(d.bytes)});
  }
  result.damaged_bytes = reader.damaged_bytes();
  log.finish();
  return result;
}

}  // namespace berth::logs
