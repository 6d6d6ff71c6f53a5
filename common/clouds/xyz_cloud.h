// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "common/clouds/cloud.h"

namespace berth::clouds {

/// A cloud of text: one point a line, x y z first unless a header says else. The header is the
/// first line that is not numbers, or a comment above the points, and names all columns. Further
/// columns that no header names are ignored. file: for messages. @throws InputError.
Cloud parse_xyz(std::string_view text, const std::string& file);

}  // namespace berth::clouds
