// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "common/clouds/cloud.h"
#include "drivers/lidar/protocol.h"
#include "lcmtypes/scan_packet.h"

namespace lcm {
class LogFile;
}

namespace berth::lidar {

struct RecordedBeam {
  Utime utime = 0;  ///< of the recording
  std::uint16_t window = 0;
  BeamReturn beam;  ///< after_us is not used
};

struct RecordedScan {
  std::string name;                 ///< for messages
  std::vector<RecordedBeam> beams;  ///< in ascending time
  bool timed = false;               ///< times of different scans share one clock
  Utime delay = 0;                  ///< from the request to the first beam, when it was recorded
  std::string failure;              ///< why the scan ended early; empty: it is complete
};

/// Recorded scans, one by one.
class Recording {
 public:
  virtual ~Recording() = default;
  /// The path that is played.
  virtual const std::string& name() const = 0;
  /// Nothing at the end. @throws InputError for a scan that cannot be read; the next call goes on
  /// after it.
  virtual std::optional<RecordedScan> next() = 0;
  virtual void rewind() = 0;
};

/// A cloud file as a scan, named as the file, its beams in ascending time. Without times in the
/// file they begin at 0 and follow one another at the LIDAR's rate. @throws InputError.
RecordedScan read_scan(const std::filesystem::path& file, double rate_hz,
                       const clouds::CloudOptions& options);

/// A directory of cloud files (common/clouds: PCD, PLY, PTX, XYZ), a scan each, in the order of
/// their names; or one file. Where a file has no times its beams follow one another at the
/// LIDAR's rate. All files are read at the start too, so that none fails in the middle of a run.
class CloudRecording final : public Recording {
 public:
  /// @throws InputError when there is no cloud; otherwise it lists all that cannot be read.
  CloudRecording(const std::filesystem::path& path, double rate_hz,
                 const clouds::CloudOptions& options = {});

  const std::string& name() const override { return name_; }
  std::optional<RecordedScan> next() override;
  void rewind() override { next_ = 0; }

 private:
  std::string name_;
  double rate_hz_;
  clouds::CloudOptions options_;
  std::vector<std::filesystem::path> files_;
  std::size_t next_ = 0;
};

/// The scans of a log, in their order: SCAN_DATA, with their request times from
/// SCAN_REQUEST. Scans without a beam (refused ones) are passed over.
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
  std::map<Key, Utime> requested_;  // when the request was recorded
  Key key_{};                       // of the scan that is being read
  RecordedScan scan_;
  std::optional<ScanPacket> ahead_;  // first of the next scan
};

}  // namespace berth::lidar
