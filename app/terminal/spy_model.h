// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "logs/inspect/channel_tally.h"

namespace berth {

/// What spy knows of the bus, or of a log.
class SpyModel {
 public:
  /// types must outlive it.
  explicit SpyModel(const logs::TypeCatalogue& types) : types_(&types) {}

  struct Channel {
    explicit Channel(const logs::TypeCatalogue& types) : tally(types) {}
    logs::ChannelTally tally;
    std::deque<std::pair<Utime, std::size_t>> recent;  ///< received, bytes: of the last seconds
    std::vector<std::uint8_t> last;                    ///< the newest message

    double rate_hz(Utime now) const;
    double bytes_per_s(Utime now) const;
  };

  void take(Utime received, const std::string& channel, Bytes message);

  /// By name.
  const std::map<std::string, Channel>& channels() const { return channels_; }

 private:
  const logs::TypeCatalogue* types_;
  std::map<std::string, Channel> channels_;
};

/// The table of all channels: a heading, then a line each. now: for ages and rates; rates over the
/// whole time when it is a log.
std::vector<std::string> channel_table(const SpyModel& model, Utime now, bool live);

/// The fields of a channel's newest message, a line each; bytes as hex when its type is not known.
std::vector<std::string> field_lines(const SpyModel::Channel& channel);

}  // namespace berth
