// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"

namespace berth::testbed {

/// Fills a message's fields.
/// @param position 3 values, m
/// @param q_wxyz 4 values
inline void set_pose(const Pose& pose, double* position, double* q_wxyz) {
  for (int i = 0; i < 3; ++i) position[i] = pose.position[i];
  q_wxyz[0] = pose.rotation.w();
  q_wxyz[1] = pose.rotation.x();
  q_wxyz[2] = pose.rotation.y();
  q_wxyz[3] = pose.rotation.z();
}

}  // namespace berth::testbed
