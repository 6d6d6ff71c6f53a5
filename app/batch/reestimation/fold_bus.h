// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/bus/bus.h"

namespace berth {

/// One node's end of a bus on which nobody else is: takes recorded messages in and hands out what
/// the node says. No thread, no queue: a message is handled when deliver() returns.
class FoldBus final : public Bus {
 public:
  using Outlet = std::function<void(const std::string& channel, Bytes bytes)>;
  explicit FoldBus(Outlet outlet) : outlet_(std::move(outlet)) {}

  /// Hands a message to the node, which may not listen to its channel.
  void deliver(std::string_view channel, Bytes bytes) {
    const auto found = handlers_.find(channel);
    if (found == handlers_.end()) return;
    ++counters_.received;
    for (const RawHandler& handler : found->second) handler(bytes);
  }

 protected:
  void send(const std::string& channel, Bytes bytes) override { outlet_(channel, bytes); }
  void receive(const std::string& channel, Queue /*handled at once*/, RawHandler handler) override {
    handlers_[channel].push_back(std::move(handler));
  }

 private:
  Outlet outlet_;
  std::map<std::string, std::vector<RawHandler>, std::less<>> handlers_;
};

}  // namespace berth
