// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/replay/replay_bus.h"

#include <chrono>

#include "common/bus/lcm_bus.h"
#include "common/core/error.h"
#include "lcmtypes/channels.h"
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

ReplayBus::ReplayBus(const std::string& url) : url_(bus_url(url)), lcm_(url_) {
  if (!lcm_.good()) {
    throw InputError("LCM cannot use " + url_ +
                     ": is there a multicast route? 'berth doctor' shows how to repair it");
  }
  lcm_.subscribe(channels::heartbeat, &ReplayBus::on_heartbeat, this);
}

bool ReplayBus::publish(const std::string& channel, Bytes bytes) {
  return lcm_.publish(channel, bytes.data(), static_cast<unsigned int>(bytes.size())) == 0;
}

void ReplayBus::on_heartbeat(const lcm::ReceiveBuffer* buffer, const std::string& /*channel*/) {
  const Bytes bytes{static_cast<const std::uint8_t*>(buffer->data), buffer->data_size};
  received_ = logs::decode<heartbeat_t>(bytes);
}

std::optional<heartbeat_t> ReplayBus::anybody_alive() {
  // A node beats at 20 Hz; one that is silent for 150 ms is dead.
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::milliseconds(400);
  received_.reset();
  while (!received_ && Clock::now() < end) lcm_.handleTimeout(50);
  return received_;
}

std::optional<heartbeat_t> ReplayBus::receive_stranger(
    const std::set<std::int64_t>& known_sessions) {
  received_.reset();
  lcm_.handleTimeout(0);
  if (received_ && known_sessions.count(received_->session) == 0) return received_;
  return std::nullopt;
}

}  // namespace berth
