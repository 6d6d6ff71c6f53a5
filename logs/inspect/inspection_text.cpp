// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cinttypes>
#include <cstdio>

#include "common/core/table.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "logs/inspect/inspection.h"
#include "logs/types/type_text.h"

namespace berth::logs {
namespace {

std::string counted(std::int64_t n, const char* one, const char* many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

const char* name_of(Finding::Kind kind) {
  constexpr const char* names[] = {
      "damage", "missing_events", "odd_number", "restart", "undecodable", "gap", "step"};
  return names[static_cast<int>(kind)];
}

std::string type_name(const ChannelTally& channel) {
  const StructType* type = channel.type();
  const std::string name = type != nullptr ? short_name(*type)
                           : channel.types().empty()
                               ? "?"
                               : hexadecimal(channel.types().front().fingerprint);
  return name + (channel.types().size() > 1 ? " ..." : "");
}

}  // namespace

std::string Finding::text() const {
  const std::string where = "byte " + std::to_string(offset);
  const std::string at = event < 0 ? std::string("before the first event")
                                   : "event " + std::to_string(event) + ", " + text_of_utime(utime);
  const std::string on = terminal_line(channel);
  switch (kind) {
    case Kind::damage:
      return where + ": " + counted(count, "byte", "bytes") + " of no event" +
             (event < 0 ? ", " : ", after ") + at;
    case Kind::missing_events:
      return where + ": " + counted(count, "event", "events") + " missing before " + at;
    case Kind::odd_number:
      return where + ": " + (channel.empty() ? "event number" : on + ": seq") +
             " is not what follows, " + at;
    case Kind::restart:
      return where + ": " +
             (channel.empty() ? std::string("event numbers begin") : on + ": seq begins") +
             " anew, " + at;
    case Kind::undecodable:
      return where + ": " + on + ": not a message of this channel's type, " + at;
    case Kind::gap:
      return where + ": " + on + ": " + counted(count, "message", "messages") + " missing before " +
             at;
    case Kind::step:
      return where + ": " + detail;
  }
  return where;
}

std::string summary_of(const Inspection& i) {
  if (i.events == 0 && i.damaged_bytes == 0) return "no message in it";
  std::string text =
      i.damaged_bytes == 0
          ? std::string("no damage")
          : counted(static_cast<std::int64_t>(i.damaged_bytes), "damaged byte", "damaged bytes") +
                " in " + counted(static_cast<std::int64_t>(i.damaged_places), "place", "places");
  text += ", " + std::to_string(i.undecodable()) + " undecodable, " + std::to_string(i.unknown()) +
          " of unknown type; missing: " + counted(i.missing_events, "event", "events") +
          " of the log, " + counted(i.missing_messages(), "message", "messages") +
          " of their channels";
  if (i.steps > 0) {
    text += "; " + counted(static_cast<std::int64_t>(i.steps), "step", "steps") + " of its clock";
  }
  return text;
}

std::string text_of(const Inspection& i) {
  const auto number = [](auto n) { return std::to_string(n); };
  std::string text = i.file.string() + ": " + counted(i.events, "message", "messages") + " on " +
                     counted(static_cast<std::int64_t>(i.channels.size()), "channel", "channels") +
                     " in " + fixed(i.duration_s(), 1) + " s, " +
                     fixed(static_cast<double>(i.size) * 1e-6, 1) + " MB";
  if (i.events > 0) text += ", from " + text_of_utime(i.first) + " UTC";
  text += "\nsessions:";
  for (const auto& [session, messages] : i.sessions) {
    text += " " + number(session) + " (" + counted(messages, "message", "messages") + ")";
  }
  text += "\n" + summary_of(i) + "\n\n";
  Table table{"ll",
              {"channel", "type", "messages", "Hz", "bytes each", "kB/s", "longest pause s",
               "missing", "undecodable"}};
  for (const auto& [name, c] : i.channels) {
    const double bytes = static_cast<double>(c.bytes());
    table.rows.push_back(
        {name, type_name(c), number(c.messages()), fixed(c.rate_hz(), 2),
         fixed(bytes / static_cast<double>(std::max<std::int64_t>(c.messages(), 1)), 0),
         fixed(i.duration_s() > 0 ? bytes * 1e-3 / i.duration_s() : 0, 2),
         fixed(seconds(c.max_pause()), 3), number(c.missing()), number(c.undecodable())});
  }
  return text + text_table(table);
}

nlohmann::ordered_json json_of(const Inspection& i) {
  nlohmann::ordered_json json;
  json["file"] = i.file.string();
  json["bytes"] = i.size;
  json["messages"] = i.events;
  json["utime_first"] = i.first;
  json["utime_last"] = i.last;
  json["duration_s"] = i.duration_s();
  json["sound"] = i.sound();
  json["damaged_bytes"] = i.damaged_bytes;
  json["damaged_places"] = i.damaged_places;
  json["missing_events"] = i.missing_events;
  json["missing_messages"] = i.missing_messages();
  json["undecodable"] = i.undecodable();
  json["unknown_type"] = i.unknown();
  json["received_backwards"] = i.backwards;
  json["steps"] = i.steps;
  json["sessions"] = nlohmann::ordered_json::array();
  for (const auto& [session, messages] : i.sessions) {
    json["sessions"].push_back({{"session", session}, {"messages", messages}});
  }
  json["channels"] = nlohmann::ordered_json::array();
  for (const auto& [name, c] : i.channels) {
    nlohmann::ordered_json channel;
    channel["channel"] = name;
    channel["messages"] = c.messages();
    channel["rate_hz"] = c.rate_hz();
    channel["bytes"] = c.bytes();
    channel["bytes_smallest"] = c.smallest();
    channel["bytes_largest"] = c.largest();
    channel["utime_first"] = c.first();
    channel["utime_last"] = c.last();
    channel["longest_pause_s"] = seconds(c.max_pause());
    channel["missing"] = c.missing();
    channel["restarts"] = c.restarts();
    channel["undecodable"] = c.undecodable();
    for (const auto& t : c.types()) {
      nlohmann::ordered_json type;
      type["fingerprint"] = hexadecimal(t.fingerprint);
      type["type"] =
          t.type == nullptr ? nlohmann::ordered_json() : nlohmann::ordered_json(t.type->name);
      type["messages"] = t.messages;
      channel["types"].push_back(type);
    }
    json["channels"].push_back(channel);
  }
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& f : i.findings) {
    json["findings"].push_back({{"kind", name_of(f.kind)},
                                {"offset", f.offset},
                                {"event", f.event},
                                {"utime", f.utime},
                                {"channel", f.channel},
                                {"count", f.count},
                                {"text", f.text()}});
  }
  return json;
}

}  // namespace berth::logs
