// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include "evaluation/compare/change.h"

namespace berth::evaluation {

/// Table of rows, status changes and verdict, for a terminal.
std::string text_of(const Change& change, double level);
/// Numbers that are not finite become null.
nlohmann::ordered_json json_of(const Change& change);

}  // namespace berth::evaluation
