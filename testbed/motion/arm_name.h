// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/cell.h"

namespace berth::testbed {

/// As an operator reads it: "the replica arm".
inline std::string arm_name(ArmRole role) { return std::string("the ") + name_of(role) + " arm"; }

}  // namespace berth::testbed
