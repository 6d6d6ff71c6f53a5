// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/log_diff.h"

#include <algorithm>
#include <unordered_map>

#include "common/core/table.h"
#include "logs/file/log_reader.h"
#include "logs/inspect/channel_tally.h"
#include "logs/inspect/value_diff.h"
#include "logs/types/type_text.h"

namespace berth::logs {
namespace {

/// One message in a list: the n-th with this seq of this sender.
struct Entry {
  std::string key;
  Utime utime = 0;
  Bytes data;
};

using Channels = std::map<std::string, std::vector<Entry>>;

/// Which places of a type make a message's key; sessions never do: each run has its own.
class Keys {
 public:
  explicit Keys(const TypeCatalogue& types) : types_(types) {}

  std::string of(const LogEvent& event) {
    std::string key;
    if (const StructType* type = types_.type_of(event.data)) {
      const auto [known, is_new] = places_.try_emplace(type);
      if (is_new) known->second = StreamFields::of(*type);
      key = known->second.key_of(event.data);
    }
    const int number = ++seen_[std::string(event.channel) + '\0' + key];
    return key + '#' + std::to_string(number);
  }

 private:
  const TypeCatalogue& types_;
  std::unordered_map<const StructType*, StreamFields> places_;
  std::unordered_map<std::string, int> seen_;
};

Channels channels_of(LogReader& reader, const TypeCatalogue& types, const ChannelPattern& wanted) {
  Channels channels;
  Keys keys(types);
  std::unordered_map<std::string_view, bool> asked;
  LogEvent event;
  while (reader.next(event)) {
    const auto [answer, is_new] = asked.try_emplace(event.channel, false);
    if (is_new) answer->second = wanted.matches(event.channel);
    if (!answer->second) continue;
    channels[std::string(event.channel)].push_back({keys.of(event), event.utime, event.data});
  }
  return channels;
}

class Differ {
 public:
  Differ(const TypeCatalogue& types, const DiffOptions& options)
      : types_(types), options_(options), fields_(options.ignore_fields, false) {
    ignored_ = [this](const std::string& path) { return ignores(path); };
  }

  void compare(const Entry& a, const Entry& b, ChannelDiff& diff) const {
    if (std::equal(a.data.begin(), a.data.end(), b.data.begin(), b.data.end())) {
      ++diff.same;
      return;
    }
    ValueDiff found;
    const StructType* type = types_.type_of(a.data);
    const auto value_a = type == nullptr ? std::nullopt : decode_value(*type, a.data);
    const auto value_b = type == nullptr ? std::nullopt : decode_value(*type, b.data);
    if (value_a && value_b) {
      found = diff_values(*type, *value_a, *value_b, options_.tolerance, ignored_);
    } else {
      found.differs = true;
      found.a = std::to_string(a.data.size()) + " bytes";
      found.b = std::to_string(b.data.size()) + " bytes";
    }
    diff.largest = std::max(diff.largest, found.largest);
    if (!found.differs) {
      ++diff.same;
      return;
    }
    if (diff.different++ > 0) return;
    diff.field = found.path;
    diff.value_a = found.a;
    diff.value_b = found.b;
    diff.utime_a = a.utime;
  }

 private:
  bool ignores(const std::string& path) const {
    const std::string name = path.substr(path.rfind('.') + 1);
    if (options_.ignore_times && (name == "session" || name.find("utime") != std::string::npos)) {
      return true;
    }
    return fields_.matches(path);
  }

  const TypeCatalogue& types_;
  const DiffOptions& options_;
  ChannelPattern fields_;
  std::function<bool(const std::string&)> ignored_;
};

ChannelDiff diff_channel(const std::vector<Entry>& a, const std::vector<Entry>& b,
                         const Differ& differ) {
  ChannelDiff diff;
  std::unordered_map<std::string_view, const Entry*> there;
  for (const Entry& entry : b) there.emplace(entry.key, &entry);
  for (const Entry& entry : a) {
    const auto found = there.find(entry.key);
    if (found == there.end()) {
      ++diff.only_a;
    } else {
      differ.compare(entry, *found->second, diff);
      there.erase(found);
    }
  }
  diff.only_b = static_cast<std::int64_t>(there.size());
  return diff;
}

}  // namespace

LogDiff diff_logs(const std::filesystem::path& a, const std::filesystem::path& b,
                  const TypeCatalogue& types, const DiffOptions& options) {
  const ChannelPattern wanted(options.channels);
  const Differ differ(types, options);
  LogReader reader_a(a);
  LogReader reader_b(b);
  const Channels in_a = channels_of(reader_a, types, wanted);
  Channels in_b = channels_of(reader_b, types, wanted);
  LogDiff diff;
  for (const auto& [name, entries] : in_a) {
    diff[name] = diff_channel(entries, in_b[name], differ);
    in_b.erase(name);
  }
  for (const auto& [name, entries] : in_b) diff[name] = diff_channel({}, entries, differ);
  return diff;
}

bool equal(const LogDiff& diff) {
  return std::all_of(diff.begin(), diff.end(), [](const auto& c) { return c.second.equal(); });
}

std::string text_of(const LogDiff& diff) {
  Table table{
      "ll",
      {"channel", "first difference", "same", "different", "only in A", "only in B", "largest"}};
  for (const auto& [name, c] : diff) {
    std::string first;
    if (c.different > 0) {
      first = (c.field.empty() ? std::string("bytes") : c.field) + ": " + c.value_a + " | " +
              c.value_b + ", A at " + text_of_utime(c.utime_a);
    }
    char largest[40];
    std::snprintf(largest, sizeof largest, "%.3g", c.largest);
    table.rows.push_back({name, first, std::to_string(c.same), std::to_string(c.different),
                          std::to_string(c.only_a), std::to_string(c.only_b),
                          c.largest > 0 ? largest : ""});
  }
  return text_table(table);
}

nlohmann::ordered_json json_of(const LogDiff& diff) {
  nlohmann::ordered_json json;
  json["equal"] = equal(diff);
  json["channels"] = nlohmann::ordered_json::array();
  for (const auto& [name, c] : diff) {
    nlohmann::ordered_json channel = {
        {"channel", name},    {"same", c.same},     {"different", c.different},
        {"only_a", c.only_a}, {"only_b", c.only_b}, {"largest", c.largest},
    };
    if (c.different > 0) {
      channel["first"] = {
          {"field", c.field}, {"a", c.value_a}, {"b", c.value_b}, {"utime_a", c.utime_a}};
    }
    json["channels"].push_back(channel);
  }
  return json;
}

}  // namespace berth::logs
