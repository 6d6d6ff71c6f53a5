// SPDX-License-Identifier: BSD-3-Clause
#include "logs/export/cloud_files.h"

#include <bit>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "lcmtypes/channels.h"
#include "logs/export/file_names.h"
#include "logs/export/output_file.h"
#include "logs/file/log_reader.h"

namespace berth::logs {
namespace {

static_assert(std::endian::native == std::endian::little, "both formats are written as they lie");

std::string pcd_header(std::size_t points) {
  const std::string n = std::to_string(points);
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
         "FIELDS x y z intensity utime\nSIZE 4 4 4 4 8\nTYPE F F F F F\nCOUNT 1 1 1 1 1\n"
         "WIDTH " +
         n + "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + n + "\nDATA binary\n";
}

std::string ply_header(const ScanCloud& scan) {
  return "ply\nformat binary_little_endian 1.0\ncomment scan " + std::to_string(scan.scan_id) +
         " of session " + std::to_string(scan.session) +
         ", sensor frame, m; utime in us since the epoch\nelement vertex " +
         std::to_string(scan.points.size()) +
         "\nproperty float x\nproperty float y\nproperty float z\nproperty float intensity\n"
         "property double utime\nend_header\n";
}

}  // namespace

void write_cloud(const ScanCloud& scan, const std::filesystem::path& path, CloudFormat format) {
  OutputFile file(path);
  file.write(format == CloudFormat::pcd ? pcd_header(scan.points.size()) : ply_header(scan));
  constexpr std::size_t bytes = 4 * sizeof(float) + sizeof(double);
  std::string points(scan.points.size() * bytes, '\0');
  char* at = points.data();
  for (const ScanPoint& p : scan.points) {
    const float floats[] = {p.x, p.y, p.z, p.intensity};
    std::memcpy(at, floats, sizeof floats);
    std::memcpy(at + sizeof floats, &p.utime, sizeof p.utime);
    at += bytes;
  }
  file.write(points);
  file.close();
}

CloudExport export_clouds(const std::filesystem::path& log, const std::filesystem::path& directory,
                          CloudFormat format) {
  LogReader reader(log);
  std::filesystem::create_directories(directory);
  const char* extension = format == CloudFormat::pcd ? ".pcd" : ".ply";
  FileNames names;
  CloudExport result;
  ScanAssembler assembler([&](const ScanCloud& scan) {
    result.packets_missing += scan.packets_missing;
    if (scan.points.empty()) {
      ++result.without_return;
      return;
    }
    char name[80];
    std::snprintf(name, sizeof name, "session_%" PRId64 "_scan_%06" PRId64, scan.session,
                  scan.scan_id);
    try {
      write_cloud(scan, directory / names.unique(name, extension), format);
    } catch (const std::runtime_error& e) {
      if (result.failed++ == 0) result.failure = e.what();
      return;
    }
    ++result.scans;
    result.points += static_cast<std::int64_t>(scan.points.size());
  });
  LogEvent event;
  while (reader.next(event)) {
    if (event.channel != channels::scan_data) continue;
    if (const auto packet = decode<scan_packet_t>(event.data)) {
      assembler.take(*packet);
    } else {
      ++result.undecodable;
    }
  }
  assembler.finish();
  return result;
}

}  // namespace berth::logs
