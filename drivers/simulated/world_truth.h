// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/ground_truth_t.hpp>
#include <filesystem>
#include <memory>
#include <vector>

namespace lcm {
class LogFile;
}

namespace berth {

/// The log of where the replica really was: channel WORLD_TRUTH in stock LCM format, a file beside
/// the run. Nothing of it goes over the bus.
class WorldTruthLog {
 public:
  /// @throws InputError when the file cannot be written.
  explicit WorldTruthLog(const std::filesystem::path& file);
  ~WorldTruthLog();

  void write(const ground_truth_t& truth);

 private:
  std::vector<char> unwritten_;  // the file's own buffer, which it needs until it is closed
  std::unique_ptr<lcm::LogFile> log_;
  std::vector<unsigned char> message_;
};

}  // namespace berth
