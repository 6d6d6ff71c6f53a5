// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/recording.h"

#include <algorithm>
#include <berth/scan_request_t.hpp>
#include <cmath>
#include <lcm/lcm-cpp.hpp>

#include "common/core/error.h"
#include "lcmtypes/channels.h"

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

namespace {

/// Damaged length fields make generated code throw.
template <class Message>
std::optional<Message> decode(const lcm::LogEvent& event) {
  try {
    Message message{};
    if (message.decode(event.data, 0, event.datalen) == event.datalen) return message;
  } catch (const std::exception&) {
  }
  return std::nullopt;
}

BeamReturn beam_of(const ScanPacket& packet, std::size_t i) {
  const auto intensity = [](std::int16_t value) {
    return static_cast<std::uint16_t>(std::max<int>(value, 0));
  };
  BeamReturn beam;
  beam.range_m = packet.range_m[i];
  beam.azimuth_rad = packet.azimuth_rad[i];
  beam.elevation_rad = packet.elevation_rad[i];
  beam.intensity = intensity(packet.intensity[i]);
  beam.status = packet.beam_status(i);
  beam.origin_m[0] = packet.origin_x_m[i];
  beam.origin_m[1] = packet.origin_y_m[i];
  beam.origin_m[2] = packet.origin_z_m[i];
  beam.ambient = packet.ambient[i];
  beam.range_sigma_m = packet.range_sigma_m[i];
  beam.range2_m = packet.range2_m[i];
  beam.range2_sigma_m = packet.range2_sigma_m[i];
  beam.intensity2 = intensity(packet.intensity2[i]);
  return beam;
}

}  // namespace

LogRecording::LogRecording(const std::filesystem::path& path)
    : file_(std::filesystem::is_directory(path) ? path / "run.lcm" : path), name_(file_.string()) {
  rewind();
  if (!next()) throw InputError(name_ + ": holds no scan (SCAN_DATA)");
  rewind();
}

LogRecording::~LogRecording() = default;

void LogRecording::rewind() {
  std::error_code error;
  if (!std::filesystem::is_regular_file(file_, error)) {
    throw InputError(name_ + ": no such log, expected a run directory or a .lcm file");
  }
  log_ = std::make_unique<lcm::LogFile>(name_, "r");
  if (!log_->good()) throw InputError(name_ + ": cannot be read");
  requested_.clear();
  scan_ = {};
  ahead_.reset();
}

std::optional<RecordedScan> LogRecording::next() {
  if (ahead_) {
    const ScanPacket packet = std::move(*ahead_);
    ahead_.reset();
    if (take(packet)) return finished(packet.reason);
  }
  while (const lcm::LogEvent* event = log_->readNextEvent()) {
    if (event->channel == channels::scan_request) {
      const auto request = decode<scan_request_t>(*event);
      if (request) requested_.try_emplace({request->session, request->scan_id}, event->timestamp);
    } else if (event->channel == channels::scan_data) {
      auto packet = decode<ScanPacket>(*event);
      if (!packet) continue;
      const bool other = Key{packet->session, packet->scan_id} != key_;
      if (other && !scan_.beams.empty()) {
        ahead_ = std::move(packet);
        return finished("its end is not in the recording");
      }
      if (take(*packet) && !scan_.beams.empty()) return finished(packet->reason);
    }
  }
  if (!scan_.beams.empty()) return finished("the recording ends in it");
  return std::nullopt;
}

/// @return whether the scan ends with it.
bool LogRecording::take(const ScanPacket& packet) {
  key_ = {packet.session, packet.scan_id};
  for (std::size_t i = 0; i < packet.range_m.size(); ++i) {
    RecordedBeam beam;
    beam.utime = packet.utime + packet.time_us[i];
    beam.window = static_cast<std::uint16_t>(std::max<int>(packet.window, 0));
    beam.beam = beam_of(packet, i);
    scan_.beams.push_back(beam);
  }
  return packet.scan_status != ScanPacket::RUNNING;
}

std::optional<RecordedScan> LogRecording::finished(const std::string& failure) {
  RecordedScan scan = std::move(scan_);
  scan_ = {};
  std::stable_sort(scan.beams.begin(), scan.beams.end(),
                   [](const RecordedBeam& a, const RecordedBeam& b) { return a.utime < b.utime; });
  scan.name = "scan " + std::to_string(key_.second);
  scan.timed = true;
  scan.failure = failure;
  const auto requested = requested_.find(key_);
  if (requested != requested_.end()) {
    scan.delay = std::max<Utime>(0, scan.beams.front().utime - requested->second);
    requested_.erase(requested_.begin(), std::next(requested));
  }
  return scan;
}

}  // namespace berth::lidar
