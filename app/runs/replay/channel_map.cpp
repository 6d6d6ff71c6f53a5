// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/channel_map.h"

#include "common/core/error.h"
#include "logs/file/log_event.h"

namespace berth {
namespace {

std::optional<std::regex> pattern(const std::string& option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  try {
    return std::regex(text, std::regex::ECMAScript | std::regex::optimize);
  } catch (const std::regex_error& error) {
    throw InputError(option + " '" + text + "': " + error.what());
  }
}

bool matches(const std::regex& pattern, std::string_view name) {
  return std::regex_match(name.begin(), name.end(), pattern);
}

}  // namespace

ChannelMap::ChannelMap(const std::vector<std::string>& remap, const std::string& only,
                       const std::string& without)
    : only_(pattern("--only", only)), without_(pattern("--without", without)) {
  for (const std::string& pair : remap) {
    const auto equals = pair.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size()) {
      throw InputError("--remap " + pair + ": expected FROM=TO, e.g. POSE_ESTIMATE=OLD_ESTIMATE");
    }
    const std::string to = pair.substr(equals + 1);
    if (to.size() > logs::format::max_channel) {
      throw InputError("--remap " + pair + ": a channel's name has at most " +
                       std::to_string(logs::format::max_channel) + " characters");
    }
    names_[pair.substr(0, equals)] = to;
  }
}

std::optional<std::string> ChannelMap::name_of(std::string_view channel) const {
  if (only_ && !matches(*only_, channel)) return std::nullopt;
  if (without_ && matches(*without_, channel)) return std::nullopt;
  const auto found = names_.find(channel);
  return found == names_.end() ? std::string(channel) : found->second;
}

}  // namespace berth
