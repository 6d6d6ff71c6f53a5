// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/world_truth.h"

#include <cstdio>
#include <lcm/lcm-cpp.hpp>

#include "common/core/error.h"
#include "lcmtypes/channels.h"

namespace berth {

WorldTruthLog::WorldTruthLog(const std::filesystem::path& file)
    : unwritten_(1 << 16), log_(std::make_unique<lcm::LogFile>(file.string(), "w")) {
  if (!log_->good()) throw InputError(file.string() + ": cannot be written");
  std::setvbuf(log_->getFilePtr(), unwritten_.data(), _IOFBF, unwritten_.size());
}

WorldTruthLog::~WorldTruthLog() = default;

void WorldTruthLog::write(const ground_truth_t& truth) {
  message_.resize(static_cast<std::size_t>(truth.getEncodedSize()));
  const int size = static_cast<int>(message_.size());
  truth.encode(message_.data(), 0, size);
  lcm::LogEvent event{};
  event.timestamp = truth.utime;
  event.channel = channels::world_truth;
  event.datalen = size;
  event.data = message_.data();
  log_->writeEvent(&event);
}

}  // namespace berth
