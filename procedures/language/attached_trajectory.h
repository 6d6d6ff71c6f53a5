// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/config.h"
#include "procedures/language/source.h"

namespace berth::procedures {

/// A trajectory that was read from elsewhere (a CSV file, an earlier run) becomes a part of the
/// procedure's own text, as a called procedure does: what was run can be run and judged anywhere.
/// @{
/// Before a step is read: what is attached takes the place of what it names.
void give_attached(const Config& step, const Source& source, const Library& library);
/// After it was read: what it read is attached.
void keep_attached(const Config& step, const Source& source, Library& library);
/// @}

/// The key under which a rule finds its text, and leaves it.
inline constexpr const char* attached_key = "attached";

}  // namespace berth::procedures
