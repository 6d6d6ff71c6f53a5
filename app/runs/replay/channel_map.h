// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

namespace berth {

/// Which channels of a log are played, and under which names.
class ChannelMap {
 public:
  /// @param remap "FROM=TO" each
  /// @param only, without regular expressions that match whole names; empty: no such filter
  /// @throws InputError for one that cannot be understood
  ChannelMap(const std::vector<std::string>& remap, const std::string& only,
             const std::string& without);

  /// The name under which to play a channel; nothing when it is left out.
  std::optional<std::string> name_of(std::string_view channel) const;
  void rename(const std::string& from, const std::string& to) { names_.try_emplace(from, to); }

 private:
  std::map<std::string, std::string, std::less<>> names_;
  std::optional<std::regex> only_;
  std::optional<std::regex> without_;
};

}  // namespace berth
