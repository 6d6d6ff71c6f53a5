// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/spy_model.h"

#include <algorithm>
#include <cstdio>
#include <sstream>

#include "common/core/table.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "logs/types/lcm_type.h"
#include "logs/types/value.h"

namespace berth {
namespace {

constexpr Utime window = 5 * second;
constexpr std::size_t max_elements = 16;  // of an array, in one line

/// Time that the recent messages stand for.
double span_s(const std::deque<std::pair<Utime, std::size_t>>& recent, Utime now) {
  return recent.empty() ? 0 : seconds(std::max(now - recent.front().first, millisecond));
}

std::string text_of(const logs::Value& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using Type = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<Type, bool>) {
          return v ? "true" : "false";
        } else if constexpr (std::is_floating_point_v<Type>) {
          char text[40];
          std::snprintf(text, sizeof text, "%.7g", static_cast<double>(v));
          return text;
        } else if constexpr (std::is_integral_v<Type>) {
          return std::to_string(v);
        } else if constexpr (std::is_same_v<Type, std::string_view>) {
          return "'" + terminal_line(first_columns(v, 200)) + (columns(v) > 200 ? "..." : "") + "'";
        } else {
          return "";
        }
      },
      value.content);
}

void add_struct(const logs::StructType& type, const logs::Value& value, const std::string& prefix,
                std::vector<std::string>& lines);

void add_field(const logs::Field& field, std::size_t dimensions, const logs::Value& value,
               const std::string& name, std::vector<std::string>& lines) {
  const bool structure = field.kind == logs::Kind::structure;
  if (dimensions == 0 && structure) {
    add_struct(*field.structure, value, name + ".", lines);
  } else if (dimensions > 1 || (dimensions == 1 && structure)) {
    if (value.list().empty()) lines.push_back(name + " = (none)");
    for (std::size_t i = 0; i < value.list().size() && i < max_elements; ++i) {
      add_field(field, dimensions - 1, value.list()[i], name + "[" + std::to_string(i) + "]",
                lines);
    }
  } else {
    std::string text;
    if (dimensions == 0) {
      text = text_of(value);
    } else {
      const auto& list = value.list();
      for (std::size_t i = 0; i < list.size() && i < max_elements; ++i) {
        text += (i == 0 ? "" : " ") + text_of(list[i]);
      }
      if (list.size() > max_elements) text += " ... (" + std::to_string(list.size()) + ")";
      if (list.empty()) text = "(none)";
    }
    const bool unit = !field.unit.empty() && text != "(none)";
    lines.push_back(name + " = " + text + (unit ? " " + field.unit : ""));
  }
}

void add_struct(const logs::StructType& type, const logs::Value& value, const std::string& prefix,
                std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < type.fields.size(); ++i) {
    const logs::Field& field = type.fields[i];
    add_field(field, field.dimensions.size(), value.list()[i], prefix + field.name, lines);
  }
}

std::vector<std::string> hex_lines(Bytes bytes) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < bytes.size() && at < 512; at += 16) {
    char text[8];
    std::snprintf(text, sizeof text, "%04zx ", at);
    std::string line = text;
    for (std::size_t i = at; i < std::min(at + 16, bytes.size()); ++i) {
      std::snprintf(text, sizeof text, " %02x", bytes[i]);
      line += text;
    }
    lines.push_back(line);
  }
  return lines;
}

std::string type_name(const SpyModel::Channel& channel) {
  const auto* type = channel.tally.type();
  return type != nullptr ? logs::short_name(*type)
                         : logs::hexadecimal(logs::fingerprint_of(channel.last));
}

}  // namespace

double SpyModel::Channel::rate_hz(Utime now) const {
  const double span = span_s(recent, now);
  return span > 0 && recent.size() > 1 ? static_cast<double>(recent.size() - 1) / span : 0;
}

double SpyModel::Channel::bytes_per_s(Utime now) const {
  std::size_t sum = 0;
  for (const auto& [received, bytes] : recent) sum += bytes;
  const double span = span_s(recent, now);
  return span > 0 && recent.size() > 1 ? static_cast<double>(sum) / span : 0;
}

void SpyModel::take(Utime received, const std::string& name, Bytes message) {
  Channel& channel = channels_.try_emplace(name, *types_).first->second;
  channel.tally.take(received, message);
  channel.recent.emplace_back(received, message.size());
  while (channel.recent.front().first < received - window) channel.recent.pop_front();
  channel.last.assign(message.begin(), message.end());
}

std::vector<std::string> channel_table(const SpyModel& model, Utime now, bool live) {
  Table table{"lll",
              {"#", "channel", "type", "messages", "Hz", "bytes", "kB/s",
               live ? "age s" : "pause s", "missing", "undecodable"}};
  int number = 0;
  for (const auto& [name, c] : model.channels()) {
    const auto& tally = c.tally;
    const double rate = live ? c.rate_hz(now) : tally.rate_hz();
    const double mean = static_cast<double>(tally.bytes()) / static_cast<double>(tally.messages());
    table.rows.push_back(
        {std::to_string(++number), name, type_name(c), std::to_string(tally.messages()),
         fixed(rate, 1), std::to_string(c.last.size()),
         fixed((live ? c.bytes_per_s(now) : mean * rate) * 1e-3, 1),
         fixed(seconds(live ? now - tally.last() : tally.max_pause()), live ? 1 : 3),
         std::to_string(tally.missing()), std::to_string(tally.undecodable())});
  }
  std::vector<std::string> lines;
  std::istringstream text(text_table(table));
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> field_lines(const SpyModel::Channel& channel) {
  const logs::StructType* type = nullptr;
  for (const auto& t : channel.tally.types()) {
    if (t.fingerprint == logs::fingerprint_of(channel.last)) type = t.type;
  }
  if (type == nullptr) return hex_lines(channel.last);
  const auto value = logs::decode_value(*type, channel.last);
  if (!value) return hex_lines(channel.last);
  std::vector<std::string> lines;
  add_struct(*type, *value, "", lines);
  return lines;
}

}  // namespace berth
