// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/core/pose.h"

namespace berth {

/// Of a Jacobian, to about 1e-8 of its greatest one (from the eigenvalues of J J^T: far quicker
/// than a decomposition).
double min_singular_value(const Matrix6d& jacobian);

}  // namespace berth
