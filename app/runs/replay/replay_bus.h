// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/heartbeat_t.hpp>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/bus.h"

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

/// The bus that a log is played onto: sends messages as they are, decodable or not, and finds
/// whether a cell is alive there, for a replayed command must never reach one.
class ReplayBus {
 public:
  /// @throws InputError for a URL that LCM cannot use
  explicit ReplayBus(const std::string& url);
  ReplayBus(const ReplayBus&) = delete;
  ReplayBus& operator=(const ReplayBus&) = delete;

  const std::string& url() const { return url_; }
  /// From any thread. @return whether the network took it
  bool publish(const std::string& channel, Bytes bytes);

  /// Listens for some heartbeat periods. @return a heartbeat of any live node
  std::optional<heartbeat_t> anybody_alive();
  /// Readable when something was received: call receive_stranger().
  int descriptor() { return lcm_.getFileno(); }
  /// @return a heartbeat of a session that is none of these, if one came
  std::optional<heartbeat_t> receive_stranger(const std::set<std::int64_t>& known_sessions);

 private:
  void on_heartbeat(const lcm::ReceiveBuffer* buffer, const std::string& channel);

  std::string url_;
  lcm::LCM lcm_;
  std::optional<heartbeat_t> received_;
};

}  // namespace berth
