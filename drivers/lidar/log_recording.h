// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>

#include "drivers/lidar/recording.h"
#include "lcmtypes/scan_packet.h"

namespace lcm {
class LogFile;
}

namespace berth::lidar {

/// The scans of a log, in their order: SCAN_DATA, with what SCAN_REQUEST tells of when they were
/// asked for. Scans without a beam (refused ones) are passed over.
class LogRecording final : public Recording {
 public:
  /// A run directory, or a log file. @throws InputError when it holds no scan.
  explicit LogRecording(const std::filesystem::path& path);
  ~LogRecording() override;

  const std::string& name() const override { return name_; }
  std::optional<RecordedScan> next() override;
  void rewind() override;

 private:
  using Key = std::pair<std::int64_t, std::int64_t>;  // session, scan id

  bool take(const ScanPacket& packet);
  std::optional<RecordedScan> finished(const std::string& failure);

  std::filesystem::path file_;
  std::string name_;
  std::unique_ptr<lcm::LogFile> log_;
  std::map<Key, Utime> asked_;  // when the request was recorded
  Key key_{};                   // of the scan that is being read
  RecordedScan scan_;
  std::optional<ScanPacket> ahead_;  // first of the next scan
};

}  // namespace berth::lidar
