// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace berth {

/// The dead time by which the testbed reckons from now on, as the event tells it: so that who has
/// the log alone reckons by the same.
struct DeadTimeTold {
  static constexpr char event_code[] = "dead-time";

  std::int64_t us = 0;  ///< from a set-point to the motion that is reported for it

  /// because: what it rests on.
  std::string text(const std::string& because) const;
  /// Nothing when it is not such a text.
  static std::optional<DeadTimeTold> parse(const std::string& text);
};

}  // namespace berth
