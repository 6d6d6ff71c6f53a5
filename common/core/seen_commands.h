// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <set>
#include <string>
#include <utility>

namespace berth {

/// Whether two messages name one command: its commander, session, time and number. Repetitions of a
/// command have the same.
template <class A, class B>
bool same_command(const A& a, const B& b) {
  return a.seq == b.seq && a.utime == b.utime && a.session == b.session &&
         a.commander == b.commander;
}

/// The commands that a node has heard, by name: tells a repetition from a new one.
class SeenCommands {
 public:
  struct Name {
    std::string commander;
    std::int64_t session = 0;
    std::int64_t utime = 0;  ///< us, the same in every repetition
    std::int64_t seq = 0;
    auto operator<=>(const Name&) const = default;
  };
  /// @return false for a repetition.
  bool add(Name name) { return names_.insert(std::move(name)).second; }
  /// The same, of a message that names its commander.
  template <class Command>
  bool add(const Command& command) {
    return add(Name{command.commander, command.session, command.utime, command.seq});
  }

 private:
  std::set<Name> names_;
};

/// Stops (HOLD, STOP, ABORT) are obeyed whoever sends them: of any session, however late, in any
/// order. What is unusual about one, in words that follow "is obeyed, although it"; empty: nothing.
/// @param now us
/// @param overtaken a later command of the same sender has come before it
template <class Message>
std::string unusual_stop(const Message& stop, std::int64_t session, std::int64_t now,
                         bool overtaken) {
  std::string words;
  const auto add = [&words](const std::string& more) {
    words += (words.empty() ? "" : " and ") + more;
  };
  if (stop.session != session) add("belongs to session " + std::to_string(stop.session));
  if (now > stop.utime_expires) {
    add("expired " + std::to_string((now - stop.utime_expires) / 1000) + " ms ago");
  }
  if (overtaken && stop.session == session) add("comes behind a later command");
  return words;
}

}  // namespace berth
