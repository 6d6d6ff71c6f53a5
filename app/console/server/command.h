// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace berth::console {

/// A command of a page (PROTOCOL.md, "Page to server").
struct Command {
  std::string viewer;   ///< its sender: "viewer-3"
  std::int64_t id = 0;  ///< the page's own: its answer carries it
  std::string name;     ///< "hold"
  nlohmann::json arguments = nlohmann::json::object();
  std::string confirm;  ///< the word of an earlier answer; empty: none
};

struct Answer {
  std::int64_t id = 0;
  bool accepted = false;
  std::string text;     ///< for the operator
  std::string confirm;  ///< not empty: the same command with this word would be carried out
};

/// The largest message that a page may send, bytes.
inline constexpr std::size_t largest_command = 65536;

/// Reads what a page sent; `viewer` stays empty.
/// @throws InputError for anything but a command as it should be: one flat object of known keys,
/// its arguments nested no deeper than a run's parameters are
Command parse_command(std::string_view text);

std::string to_json(const Answer& answer);

}  // namespace berth::console
