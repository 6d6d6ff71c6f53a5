// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/command.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/core/valid_text.h"

namespace berth::console {
namespace {

using nlohmann::json;

constexpr int deepest = 6;  // objects and lists within each other
constexpr std::size_t max_word = 64;

/// The value of a key, which must be of the expected kind.
const json& required(const json& object, const char* key, json::value_t kind,
                     const char* expected) {
  const auto found = object.find(key);
  if (found == object.end()) throw InputError(std::string("a command without '") + key + "'");
  const bool unsigned_too = kind == json::value_t::number_integer && found->is_number_integer();
  if (found->type() != kind && !unsigned_too) {
    throw InputError(std::string("a command's '") + key + "': expected " + expected);
  }
  return *found;
}

bool is_word(const std::string& text) {
  return !text.empty() && text.size() <= max_word &&
         std::all_of(text.begin(), text.end(),
                     [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; });
}

json parse(std::string_view text) {
  try {
    return json::parse(text, [](int depth, json::parse_event_t, json&) {
      if (depth > deepest) throw InputError("a command that is nested too deeply");
      return true;
    });
  } catch (const json::exception& e) {
    throw InputError(std::string("not JSON: ") + e.what());
  }
}

}  // namespace

Command parse_command(std::string_view text) {
  if (text.size() > largest_command) throw InputError("a command that is too long");
  const json object = parse(text);
  if (!object.is_object()) throw InputError("a command that is no JSON object");
  for (const auto& [key, value] : object.items()) {
    const bool known =
        key == "type" || key == "id" || key == "command" || key == "arguments" || key == "confirm";
    if (!known) throw InputError("a command with a key that none has");
  }
  if (required(object, "type", json::value_t::string, "text") != "command") {
    throw InputError("a message whose 'type' is not 'command'");
  }
  Command command;
  command.id =
      required(object, "id", json::value_t::number_integer, "a whole number").get<std::int64_t>();
  command.name = required(object, "command", json::value_t::string, "text").get<std::string>();
  if (!is_word(command.name)) throw InputError("a command whose name is no word");
  if (object.contains("arguments")) {
    command.arguments = required(object, "arguments", json::value_t::object, "an object");
  }
  if (object.contains("confirm")) {
    command.confirm = required(object, "confirm", json::value_t::string, "text").get<std::string>();
    if (command.confirm.size() > max_word) throw InputError("a command's 'confirm': too long");
  }
  return command;
}

std::string to_json(const Answer& answer) {
  const json object{{"type", "answer"},
                    {"id", answer.id},
                    {"accepted", answer.accepted},
                    {"text", answer.text},
                    {"confirm", answer.confirm}};
  return json_text(object);
}

}  // namespace berth::console
