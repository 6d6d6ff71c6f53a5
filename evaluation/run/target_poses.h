// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "evaluation/run/truth_track.h"

namespace berth::evaluation {

/// By what it is known where the target was: GROUND_TRUTH or POSE_ESTIMATE.
enum class PoseSource { truth, estimate };

/// Where the target was over a log, of all its sessions.
class TargetPoses {
 public:
  /// @throws InputError when the log cannot be read.
  TargetPoses(const std::filesystem::path& log, PoseSource source);

  /// T_sensor_model (m) at the time of a return of that scan. Truth is interpolated. An estimate is
  /// that of the scan itself, of several the nearest in time, moved along its velocity. Nothing
  /// where there is no truth, or where the scan has no estimate with status OK.
  std::optional<Pose> at(std::int64_t session, std::int64_t scan_id, Utime utime) const;

 private:
  struct Estimate {
    Utime utime = 0;
    Pose pose;          // T_sensor_model
    Velocity velocity;  // sensor frame
  };
  std::map<std::int64_t, TruthTrack> truth_;                                          // by session
  std::map<std::pair<std::int64_t, std::int64_t>, std::vector<Estimate>> estimates_;  // and scan
};

}  // namespace berth::evaluation
