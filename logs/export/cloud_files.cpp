// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/cloud_files.h"

#include <bit>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <map>
#include <stdexcept>

#include "lcmtypes/channels.h"
#include "logs/export/file_names.h"
#include "logs/export/output_file.h"
#include "logs/file/log_reader.h"

namespace berth::logs {
namespace {

static_assert(std::endian::native == std::endian::little, "both formats are written as they lie");

/// A text for each of point_fields, which stands for '%' in it.
std::string each_field(const std::string& text) {
  std::string all;
  for (const char* field : point_fields) {
    const std::size_t at = text.find('%');
    all += at == std::string::npos ? text : std::string(text).replace(at, 1, field);
  }
  return all;
}

std::string pcd_header(std::size_t points) {
  const std::string n = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
         "FIELDS" +
         each_field(" %") + " utime\nSIZE" + each_field(" 4") + " 8\nTYPE" + each_field(" F") +
         " F\nCOUNT" + each_field(" 1") + " 1\nWIDTH " + n +
         "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary\n";
}

std::string ply_header(const ScanCloud& scan) {
  const std::string of_scan = scan.scan_id > 0 ? "scan " + std::to_string(scan.scan_id) : "scans";
  return "ply\nformat binary_little_endian 1.0\ncomment " + of_scan + " of session " +
         std::to_string(scan.session) + ", " + scan.frame +
         " frame, m; utime in us since the epoch\nelement vertex " +
         std::to_string(scan.points.size()) + each_field("\nproperty float %") +
         "\nproperty double utime\nend_header\n";
}

/// Moves every return to the model's frame. @return how many had no pose and were left out.
std::int64_t to_model_frame(ScanCloud& scan, const ModelPose& pose_at) {
  std::vector<ScanPoint> points;
  points.reserve(scan.points.size());
  for (ScanPoint point : scan.points) {
    const auto pose = pose_at(scan, static_cast<Utime>(point.utime));
    if (!pose) continue;
    const Eigen::Vector3d in_sensor = Eigen::Vector3f(point.x, point.y, point.z).cast<double>();
    const Eigen::Vector3f in_model = (pose->inverse() * in_sensor).cast<float>();
    point.x = in_model.x();
    point.y = in_model.y();
    point.z = in_model.z();
    points.push_back(point);
  }
  const auto left_out = std::ssize(scan.points) - std::ssize(points);
  scan.points = std::move(points);
  scan.frame = "model";
  return left_out;
}

}  // namespace

void write_cloud(const ScanCloud& scan, const std::filesystem::path& path, CloudFormat format) {
  OutputFile file(path);
  file.write(format == CloudFormat::pcd ? pcd_header(scan.points.size()) : ply_header(scan));
  constexpr std::size_t bytes = point_fields.size() * sizeof(float) + sizeof(double);
  std::string points(scan.points.size() * bytes, '\0');
  char* at = points.data();
  for (const ScanPoint& p : scan.points) {
    const auto floats = floats_of(p);
    std::memcpy(at, floats.data(), sizeof floats);
    std::memcpy(at + sizeof floats, &p.utime, sizeof p.utime);
    at += bytes;
  }
  file.write(points);
  file.close();
}

CloudExport export_clouds(const std::filesystem::path& log, const std::filesystem::path& directory,
                          const CloudOptions& options) {
  LogReader reader(log);
  std::filesystem::create_directories(directory);
  const char* extension = options.format == CloudFormat::pcd ? ".pcd" : ".ply";
  FileNames names;
  CloudExport result;
  std::map<std::int64_t, ScanCloud> merged;  // by session
  const auto write = [&](const ScanCloud& cloud, const std::string& name) {
    try {
      write_cloud(cloud, directory / names.unique(name, extension), options.format);
      return true;
    } catch (const std::runtime_error& e) {
      if (result.failed++ == 0) result.failure = e.what();
      return false;
    }
  };
  ScanAssembler assembler([&](ScanCloud scan) {
    result.packets_missing += scan.packets_missing;
    if (options.model_pose) result.without_pose += to_model_frame(scan, options.model_pose);
    if (scan.points.empty()) {
      ++result.without_return;
      return;
    }
    const std::string session = "session_" + std::to_string(scan.session);
    if (options.merge) {
      ScanCloud& all = merged[scan.session];
      all.session = scan.session;
      all.frame = scan.frame;
      all.points.insert(all.points.end(), scan.points.begin(), scan.points.end());
    } else {
      char number[40];
      std::snprintf(number, sizeof number, "_scan_%06" PRId64, scan.scan_id);
      if (!write(scan, session + number)) return;
    }
    ++result.scans;
    result.points += static_cast<std::int64_t>(scan.points.size());
  });
  LogEvent event;
  while (reader.next(event)) {
    if (event.channel != channels::scan_data) continue;
    if (const auto packet = decode<ScanPacket>(event.data)) {
      assembler.take(*packet);
    } else {
      ++result.undecodable;
    }
  }
  assembler.finish();
  for (const auto& [session, cloud] : merged) {
    write(cloud, "session_" + std::to_string(session) + "_merged");
  }
  return result;
}

}  // namespace berth::logs
