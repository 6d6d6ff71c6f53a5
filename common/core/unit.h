// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string_view>

#include "common/core/quantity.h"

namespace berth {

/// What the unit of this name is in SI units, as in quantities; nothing where the dimension has
/// none of that name.
std::optional<double> find_unit(std::string_view name, Dimension dimension);

}  // namespace berth
