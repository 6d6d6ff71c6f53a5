// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/cloud_recording.h"

#include <algorithm>
#include <cmath>

#include "common/core/error.h"

namespace berth::lidar {
namespace fs = std::filesystem;

CloudRecording::CloudRecording(const fs::path& path, double rate_hz,
                               const clouds::CloudOptions& options)
    : name_(path.string()), rate_hz_(rate_hz), options_(options) {
  std::error_code error;
  if (fs::is_directory(path, error)) {
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.is_regular_file() && clouds::is_cloud(entry.path())) {
        files_.push_back(entry.path());
      }
    }
    std::sort(files_.begin(), files_.end());
    if (files_.empty()) {
      throw InputError(name_ + ": holds no cloud (" + clouds::known_extensions() + ")");
    }
  } else if (fs::is_regular_file(path, error)) {
    files_.push_back(path);
  } else {
    throw InputError(name_ + ": no such cloud file or directory");
  }
  std::string faults;
  for (const fs::path& file : files_) {
    try {
      clouds::read_cloud(file, options_);
    } catch (const InputError& e) {
      faults += (faults.empty() ? "" : "\n") + std::string(e.what());
    }
  }
  if (!faults.empty()) throw InputError(faults);
}

std::optional<RecordedScan> CloudRecording::next() {
  if (next_ == files_.size()) return std::nullopt;
  return read_scan(files_[next_++], rate_hz_, options_);
}

RecordedScan read_scan(const fs::path& file, double rate_hz, const clouds::CloudOptions& options) {
  const clouds::Cloud cloud = clouds::read_cloud(file, options);
  RecordedScan scan;
  scan.name = file.filename().string();
  scan.timed = cloud.has_times;
  scan.beams.reserve(cloud.beams.size());
  for (const clouds::CloudBeam& raw : cloud.beams) {
    RecordedBeam beam;
    beam.utime = cloud.has_times
                     ? raw.utime
                     : std::llround(static_cast<double>(scan.beams.size()) * 1e6 / rate_hz);
    beam.beam.range_m = static_cast<float>(raw.range);
    beam.beam.range_sigma_m = static_cast<float>(raw.range_sigma);
    beam.beam.azimuth_rad = static_cast<float>(raw.azimuth);
    beam.beam.elevation_rad = static_cast<float>(raw.elevation);
    beam.beam.status = raw.hit ? BeamStatus::hit : BeamStatus::miss;
    scan.beams.push_back(beam);
  }
  std::stable_sort(scan.beams.begin(), scan.beams.end(),
                   [](const RecordedBeam& a, const RecordedBeam& b) { return a.utime < b.utime; });
  return scan;
}

}  // namespace berth::lidar
