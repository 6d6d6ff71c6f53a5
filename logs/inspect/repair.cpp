// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/repair.h"

#include <functional>
#include <set>
#include <string>

#include "logs/file/derived_log.h"
#include "logs/types/value.h"

namespace berth::logs {
namespace {

using ChannelNames = std::set<std::string, std::less<>>;

/// The channels that carry a type we know.
ChannelNames known_channels(const std::filesystem::path& log, const TypeCatalogue& types) {
  LogReader reader(log);
  ChannelNames known;
  LogEvent event;
  while (reader.next(event)) {
    if (types.type_of(event.data) != nullptr && !known.contains(event.channel)) {
      known.emplace(event.channel);
    }
  }
  return known;
}

/// As the inspection judges it: what it would not call sound is left out.
bool is_good(const LogEvent& event, const TypeCatalogue& types, const ChannelNames& known) {
  if (event.data.size() < 8) return false;
  const StructType* type = types.type_of(event.data);
  return type != nullptr ? is_message(*type, event.data) : !known.contains(event.channel);
}

}  // namespace

Repair repair(const std::filesystem::path& in, const std::filesystem::path& out,
              const TypeCatalogue& types) {
  constexpr std::int64_t most_findings = 100;
  const ChannelNames known = known_channels(in, types);
  LogReader reader(in);
  DerivedLog log(out);
  Repair result;
  LogEvent event;
  while (reader.next(event)) {
    if (!is_good(event, types, known)) {
      if (result.dropped++ < most_findings) {
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
