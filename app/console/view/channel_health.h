// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <map>
#include <string>

#include "app/console/view/cell_status.h"
#include "app/console/view/section.h"
#include "app/terminal/spy_model.h"

namespace berth::console {

/// Health of nodes and channels: the sections `nodes` and `channels`. Rates and latencies are of
/// the last seconds, counts since the console listens.
class ChannelHealth {
 public:
  /// types must outlive it.
  explicit ChannelHealth(const logs::TypeCatalogue& types) : types_(&types), spy_(types) {}

  void take(const logs::LogEvent& event);
  std::string channels_json(Utime now) const;
  std::string nodes_json(const CellMessages& latest, Utime now) const;

 private:
  /// What one node publishes on a channel that several share.
  struct Share {
    logs::SequenceCounter counter;
    std::int64_t session = 0;
  };

  void count_share(const logs::LogEvent& event);
  void measure_latency(const logs::LogEvent& event);
  double rate_of(const std::string& channel, Utime now) const;

  const logs::TypeCatalogue* types_;
  SpyModel spy_;
  std::map<std::pair<std::string, std::string>, Share> shares_;  // by node and channel
  std::map<std::string, double> latencies_;                      // by channel, s, smoothed
};

}  // namespace berth::console
