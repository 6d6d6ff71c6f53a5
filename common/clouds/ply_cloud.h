// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "common/clouds/cloud.h"

namespace berth::clouds {

/// The vertices of a PLY file; other elements, and lists, do not matter. file: for messages.
/// @throws InputError naming line or byte.
Cloud parse_ply(std::string_view bytes, const std::string& file, const CloudOptions& options);

}  // namespace berth::clouds
