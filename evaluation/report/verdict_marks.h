// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/measure/criterion.h"
#include "evaluation/report/html.h"

namespace berth::report {

/// How far a value is inside its limits, as a part of the limit (of half the room between two);
/// negative outside, NaN where nothing was measured or nothing limits it.
double relative_margin(const criterion_result_t& criterion);

/// "≤ 20", "3 to 5": what is allowed, without the unit.
Html limits_of(const criterion_result_t& criterion);

/// Class of page.css that colours it: "good", "bad", "unsure" or "grey".
const char* class_of_outcome(std::int8_t outcome);
const char* class_of_result(std::int8_t result);

}  // namespace berth::report
