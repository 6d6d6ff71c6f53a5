// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/control/page_command.h"

#include <cmath>

#include "common/core/error.h"
#include "common/core/pose.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::console {
namespace {

InputError complaint(const Command& command, const std::string& key, const nlohmann::json& found,
                     const std::string& expected) {
  return InputError(command.name + ": " + key + ": found " + json_text(found) + ", expected " +
                    expected);
}

}  // namespace

std::string text_in(const Command& command, const std::string& key) {
  const auto found = command.arguments.find(key);
  if (found == command.arguments.end()) return {};
  if (!found->is_string()) throw complaint(command, key, *found, "a text");
  return found->get<std::string>();
}

double number_in(const Command& command, const std::string& key) {
  const auto found = command.arguments.find(key);
  if (found == command.arguments.end()) throw complaint(command, key, nullptr, "a number");
  if (!found->is_number() || !std::isfinite(found->get<double>())) {
    throw complaint(command, key, *found, "a number");
  }
  return found->get<double>();
}

std::map<std::string, std::string> parameters_in(const Command& command) {
  std::map<std::string, std::string> parameters;
  const auto found = command.arguments.find("parameters");
  if (found == command.arguments.end()) return parameters;
  if (!found->is_object()) throw complaint(command, "parameters", *found, "names and values");
  for (const auto& [name, value] : found->items()) {
    if (!value.is_string() && !value.is_number()) {
      throw complaint(command, "parameters." + name, value, "a text or a number");
    }
    parameters[name] = value.is_string() ? value.get<std::string>() : json_text(value);
  }
  return parameters;
}

std::string lamps_text(const Command& command) {
  struct Lamp {
    const char* key;
    double factor;
    const char* unit;
  };
  constexpr Lamp lamps[] = {{"sun", 100, " %"},
                            {"albedo", 100, " %"},
                            {"azimuth", degrees(1.0), " deg"},
                            {"elevation", degrees(1.0), " deg"}};
  std::string text;
  for (const Lamp& lamp : lamps) {
    if (!command.arguments.contains(lamp.key)) continue;
    text += (text.empty() ? "" : ", ") + std::string(lamp.key) + ": " +
            fixed(lamp.factor * number_in(command, lamp.key), 1) + lamp.unit;
  }
  return text;
}

namespace {

std::string what_of(const Command& command) {
  return command.name + " " + json_text(command.arguments);
}

}  // namespace

std::string Confirmations::request(const Command& command, Utime now) {
  Pending& pending = pending_[command.viewer];
  pending = {"yes-" + std::to_string(++count_), what_of(command), now + confirm_lifetime};
  return pending.word;
}

bool Confirmations::given(const Command& command, Utime now) {
  if (command.confirm.empty()) return false;
  const auto found = pending_.find(command.viewer);
  if (found == pending_.end()) return false;
  const Pending pending = found->second;
  pending_.erase(found);
  return command.confirm == pending.word && what_of(command) == pending.what &&
         now <= pending.until;
}

}  // namespace berth::console
