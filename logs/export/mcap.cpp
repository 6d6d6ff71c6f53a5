// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/mcap.h"

#include <algorithm>
#include <map>
#include <optional>

#include "common/core/version.h"
#include "logs/export/foxglove.h"
#include "logs/export/json_text.h"
#include "logs/export/mcap_writer.h"
#include "logs/file/log_reader.h"
#include "logs/types/value.h"

namespace berth::logs {
namespace {

constexpr char json[] = "json";
constexpr char json_schema[] = "jsonschema";

/// Gives each channel and type of the log a channel of the file, when it first comes.
class Topics {
 public:
  explicit Topics(McapWriter& writer) : writer_(writer) {}

  std::uint16_t of(std::string_view channel, const StructType& type) {
    const auto [entry, is_new] = channels_.try_emplace({channel, type.fingerprint}, 0);
    if (is_new) {
      std::uint16_t& schema = schemas_[{type.name, type.fingerprint}];
      if (schema == 0) schema = writer_.add_schema(type.name, json_schema, json_schema_of(type));
      entry->second = writer_.add_channel(schema, std::string(channel), json);
    }
    return entry->second;
  }

  std::uint16_t of(Foxglove::Topic topic) {
    const Foxglove::Description& d = Foxglove::description(topic);
    const auto [entry, is_new] = channels_.try_emplace({d.topic, 0}, 0);
    if (is_new) {
      std::uint16_t& schema = schemas_[{d.schema, 0}];
      if (schema == 0) schema = writer_.add_schema(d.schema, json_schema, d.json_schema());
      entry->second = writer_.add_channel(schema, d.topic, json);
    }
    return entry->second;
  }

  std::int64_t size() const { return static_cast<std::int64_t>(channels_.size()); }

 private:
  McapWriter& writer_;
  std::map<std::pair<std::string, std::uint64_t>, std::uint16_t> schemas_;
  std::map<std::pair<std::string_view, std::uint64_t>, std::uint16_t> channels_;
};

}  // namespace

McapExport export_mcap(const std::filesystem::path& log, const std::filesystem::path& out,
                       const TypeCatalogue& types,
                       const std::function<bool(std::string_view)>& selected) {
  LogReader reader(log);
  McapWriter writer(out, std::string("berth ") + version());
  Topics topics(writer);
  McapExport result;
  LogEvent event;
  // MCAP has no time before 1970.
  const auto now = [&event] {
    return static_cast<std::uint64_t>(std::clamp<Utime>(event.utime, 0, INT64_MAX / 1000)) * 1000;
  };
  Foxglove foxglove([&](Foxglove::Topic topic, const std::string& text) {
    writer.write(topics.of(topic), now(), text);
  });
  std::string text;
  while (reader.next(event)) {
    if (!selected(event.channel)) continue;
    const StructType* type = types.type_of(event.data);
    const auto value = type == nullptr ? std::nullopt : decode_value(*type, event.data);
    if (!value) {
      ++(type == nullptr ? result.unknown : result.undecodable);
      continue;
    }
    text.clear();
    append_json(*type, *value, text);
    writer.write(topics.of(event.channel, *type), now(), text);
    foxglove.take(event);
  }
  writer.close();
  result.messages = writer.messages();
  result.channels = topics.size();
  return result;
}

}  // namespace berth::logs
