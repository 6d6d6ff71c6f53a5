// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"

namespace berth::testbed {

/// The vector, no longer than `greatest`; its direction is kept.
inline Vector3d shortened(const Vector3d& v, double greatest) {
  const double length = v.norm();
  return length <= greatest ? v : Vector3d(v * (greatest / length));
}

}  // namespace berth::testbed
