// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "estimator/beam/scan.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// When a pose is not believed, however well it was measured.
struct VerificationOptions {
  double max_beside = 0.2;    ///< share of the returns about the target that do not lie on it
  double max_through = 0.25;  ///< share of the beams on it, not stopped before, that go through it
  double about = 0.1;         ///< "about the target": nearer than this to it, of its length
  double min_width = 0.01;    ///< of the returns about the target across their extent, of length
  int beams = 2000;           ///< of a scan that are looked at
};

/// Why a pose (T_sensor_model) cannot be the target's; empty when nothing speaks against it. A
/// likelihood compares poses of one target; this asks whether what was found is the target at all:
/// of part of something larger, the rest lies beside it; something smaller is gone through, and a
/// line or a spot holds nothing.
std::string doubt(const TargetModel& model, const BeamModel& beam_model, const CleanScan& scan,
                  const Pose& pose, const VerificationOptions& options = {});

}  // namespace berth::estimator
