// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <variant>

#include "testbed/guidance/flight.h"
#include "testbed/guidance/target_motion.h"

namespace berth::testbed {

/// The flight as it goes with an estimator that is right and on time: what the arms will have to
/// deliver (T_sensor_model over time), or why it would not reach its end. A pose is kept for as
/// long as the target moves.
std::variant<std::shared_ptr<const RelativePath>, std::string> forecast(const Flight& flight,
                                                                        const TargetMotion& motion,
                                                                        std::int64_t now,
                                                                        std::int64_t dead_time);

}  // namespace berth::testbed
