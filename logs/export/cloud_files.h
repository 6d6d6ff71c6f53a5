// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "common/core/pose.h"
#include "logs/export/scans.h"

namespace berth::logs {

enum class CloudFormat { pcd, ply };

struct CloudExport {
  std::int64_t scans = 0;
  std::int64_t points = 0;
  std::int64_t without_return = 0;  ///< scans that made no file
  std::int64_t packets_missing = 0;
  std::int64_t undecodable = 0;
  std::int64_t without_pose = 0;  ///< returns at times without a known pose of the target
  std::int64_t failed = 0;        ///< scans whose file could not be made, or was there already
  std::string failure = {};       ///< why the first of them
};

/// Writes one scan: binary, the fields of ScanPoint (floats; utime a double). Read back by berth
/// estimate and by PCL.
/// @throws InputError when the file is there; std::runtime_error when the disk is full.
void write_cloud(const ScanCloud& scan, const std::filesystem::path& path, CloudFormat format);

/// T_sensor_model at the time of a return of this scan; nothing where that is not known.
using ModelPose = std::function<std::optional<Pose>(const ScanCloud& scan, Utime utime)>;

struct CloudOptions {
  CloudFormat format = CloudFormat::pcd;
  ModelPose model_pose = {};  ///< the clouds are in the model's frame; empty: the sensor's
  bool merge = false;         ///< all scans of a session in one file, in memory before
};

/// Writes every scan of a log's SCAN_DATA that has a return: session_S_scan_N.pcd or .ply, with
/// "-2" for one whose number comes again; merged, session_S_merged. Returns without a pose of the
/// model are left out. @throws InputError when the log cannot be read.
CloudExport export_clouds(const std::filesystem::path& log, const std::filesystem::path& directory,
                          const CloudOptions& options);

}  // namespace berth::logs
