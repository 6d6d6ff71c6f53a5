// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <regex>
#include <string>
#include <string_view>

#include "common/core/error.h"

namespace berth::logs {

/// A regular expression (ECMAScript) that must match a channel's whole name, as LCM's
/// subscriptions do.
class ChannelPattern {
 public:
  /// empty_matches: whether an empty expression matches every channel.
  /// @throws InputError when the expression is none.
  explicit ChannelPattern(const std::string& expression, bool empty_matches = true)
      : empty_(expression.empty()), empty_matches_(empty_matches) {
    try {
      expression_ = std::regex(expression);
    } catch (const std::regex_error& e) {
      throw InputError("found '" + expression +
                       "', expected a regular expression of channels: " + e.what());
    }
  }

  bool matches(std::string_view channel) const {
    return empty_ ? empty_matches_ : std::regex_match(channel.begin(), channel.end(), expression_);
  }

 private:
  std::regex expression_;
  bool empty_;
  bool empty_matches_;
};

}  // namespace berth::logs
