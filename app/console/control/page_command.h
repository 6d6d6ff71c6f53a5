// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "app/console/server/command.h"
#include "common/bus/loop.h"

namespace berth::console {

/// Arguments of a page's command. All throw InputError naming command, argument, what was found and
/// what was expected.

/// Empty when it is not there.
std::string text_in(const Command& command, const std::string& key);
/// Finite.
double number_in(const Command& command, const std::string& key);
/// `parameters`: name and value; numbers are written as text.
std::map<std::string, std::string> parameters_in(const Command& command);
/// sun and albedo (0..1), azimuth and elevation (rad), those that are there, as a lights step has
/// them: "sun: 80 %, azimuth: 30 deg".
std::string lamps_text(const Command& command);

/// How long a word is good.
inline constexpr Utime confirm_lifetime = 10 * second;

/// Words with which what is hazardous is requested a second time. A word is good once, for ten
/// seconds, for the same viewer and exactly the same command; each viewer has one at a time.
class Confirmations {
 public:
  /// A new word for this command.
  std::string request(const Command& command, Utime now);
  /// Whether the command came with its word. The word is then used up, whether it was right or not.
  bool given(const Command& command, Utime now);

 private:
  struct Pending {
    std::string word;
    std::string what;
    Utime until = 0;
  };
  std::map<std::string, Pending> pending_;  // by viewer
  std::uint64_t count_ = 0;
};

}  // namespace berth::console
