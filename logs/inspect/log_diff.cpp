// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/log_diff.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <unordered_map>

#include "common/core/table.h"
#include "common/core/valid_text.h"
#include "logs/file/log_reader.h"
#include "logs/inspect/channel_tally.h"
#include "logs/types/lcm_type.h"
#include "logs/types/value.h"

namespace berth::logs {
namespace {

/// Where two messages of one type differ.
struct ValueDiff {
  bool differs = false;
  std::string path;  ///< of the first field that does
  std::string a;
  std::string b;
  double largest = 0;  ///< greatest difference of real numbers, also within the tolerance
};

std::string shown_value(const Value& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using Type = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<Type, std::string_view>) {
          return "'" + std::string(first_columns(v, 60)) + (columns(v) > 60 ? "..." : "") + "'";
        } else if constexpr (std::is_same_v<Type, Value::List>) {
          return std::to_string(v.size()) + " elements";
        } else {
          return json_text(nlohmann::json(v));
        }
      },
      value.content);
}

class Comparer {
 public:
  Comparer(double tolerance, const std::function<bool(const std::string&)>& ignored)
      : tolerance_(tolerance), ignored_(ignored) {}

  void structure(const StructType& type, const Value& a, const Value& b,
                 const std::string& prefix) {
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      const Field& field = type.fields[i];
      const std::string path = prefix + field.name;
      if (ignored_(path)) continue;
      array(field, field.dimensions.size(), a.list()[i], b.list()[i], path);
    }
  }

  ValueDiff result;

 private:
  void array(const Field& field, std::size_t dimensions, const Value& a, const Value& b,
             const std::string& path) {
    if (dimensions == 0) {
      if (field.kind == Kind::structure) {
        structure(*field.structure, a, b, path + ".");
      } else {
        element(a, b, path);
      }
      return;
    }
    if (a.list().size() != b.list().size()) {
      record(a, b, path);
      return;
    }
    for (std::size_t i = 0; i < a.list().size(); ++i) {
      array(field, dimensions - 1, a.list()[i], b.list()[i], path + "[" + std::to_string(i) + "]");
    }
  }

  void element(const Value& a, const Value& b, const std::string& path) {
    if (a.content == b.content) return;
    const bool real =
        std::holds_alternative<double>(a.content) || std::holds_alternative<float>(a.content);
    if (real) {
      const double x = *number_of(a);
      const double y = *number_of(b);
      if (std::isnan(x) && std::isnan(y)) return;
      const double distance = std::abs(x - y);
      if (!std::isnan(distance)) result.largest = std::max(result.largest, distance);
      if (distance <= tolerance_) return;
    }
    record(a, b, path);
  }

  void record(const Value& a, const Value& b, const std::string& path) {
    if (result.differs) return;
    result.differs = true;
    result.path = path;
    result.a = shown_value(a);
    result.b = shown_value(b);
  }

  double tolerance_;
  const std::function<bool(const std::string&)>& ignored_;
};

/// ignored: whether a field's path does not count. NaN equals NaN.
ValueDiff diff_values(const StructType& type, const Value& a, const Value& b, double tolerance,
                      const std::function<bool(const std::string&)>& ignored) {
  Comparer comparer(tolerance, ignored);
  comparer.structure(type, a, b, "");
  return comparer.result;
}

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

Channels channels_of(LogReader& reader, const TypeCatalogue& types, const ChannelPattern& pattern) {
  Channels channels;
  Keys keys(types);
  std::unordered_map<std::string_view, bool> is_selected;
  LogEvent event;
  while (reader.next(event)) {
    const auto [answer, is_new] = is_selected.try_emplace(event.channel, false);
    if (is_new) answer->second = pattern.matches(event.channel);
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
  const ChannelPattern pattern(options.channels);
  const Differ differ(types, options);
  LogReader reader_a(a);
  LogReader reader_b(b);
  const Channels in_a = channels_of(reader_a, types, pattern);
  Channels in_b = channels_of(reader_b, types, pattern);
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
