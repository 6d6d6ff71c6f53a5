// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "common/clouds/cloud.h"
#include "drivers/lidar/recording.h"

namespace berth::lidar {

/// A cloud file as a scan, named as the file, its beams in ascending time. Without times in the
/// file they begin at 0 and follow one another at the LIDAR's rate. @throws InputError.
RecordedScan read_scan(const std::filesystem::path& file, double rate_hz,
                       const clouds::CloudOptions& options);

/// A directory of cloud files (common/clouds: PCD, PLY, PTX, XYZ), a scan each, in the order of
/// their names; or one file. Where a file has no times its beams follow one another at the
/// LIDAR's rate. All files are read at the start too, so that none fails in the middle of a run.
class CloudRecording final : public Recording {
 public:
  /// @throws InputError when there is no cloud, or naming every one that cannot be read.
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

}  // namespace berth::lidar
