// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "app/runs/run_files.h"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "common/bus/simulation.h"
#include "logs/file/log_event.h"

namespace berth {

/// One node's end of a bus without other nodes: takes recorded messages in and hands out those that
/// the node publishes. No thread, no queue: a message is handled when deliver() returns.
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

/// The estimator's node alone, fed with recorded messages: the same node as in a cell, on a clock
/// that shows the time of the log. The same messages give the same estimates, to the bit.
///
/// Scans are as recorded: the estimator's requests are handed out but obeyed by no device. It uses
/// the recorded scans by their numbers, as it would those of a LIDAR that ignores requests.
class EstimatorFold {
 public:
  /// @param start the clock's first time
  /// @param outlet sees every message of the node, at the clock's time
  /// @throws InputError for what is wrong in the configuration
  EstimatorFold(const RunFiles& files, Utime start, FoldBus::Outlet outlet);

  /// A message of the log. All that is no input of the estimator only moves the clock.
  void take(const logs::LogEvent& event);
  Utime now() const { return simulation_.now(); }

  /// Whether this is one of the two inputs.
  static bool is_input(const logs::LogEvent& event);
  /// Whether an estimator published this: on its four channels, or with its node's own state.
  static bool is_output(const logs::LogEvent& event);

 private:
  Simulation simulation_;
  FoldBus bus_;
  std::unique_ptr<Node> node_;
};

}  // namespace berth
