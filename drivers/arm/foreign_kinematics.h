// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "drivers/arm/adapter.h"

namespace berth {

/// m between the flange as the controller reports it and as the kinematics put it; nothing where
/// the controller reports none.
std::optional<double> flange_difference(const ArmReport& report, const ArmKinematics& kinematics);

/// Empty, or how both disagree by more than rounding does.
std::string foreign_kinematics(const ArmReport& report, const ArmKinematics& kinematics);

}  // namespace berth
