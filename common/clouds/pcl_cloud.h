// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "common/clouds/cloud.h"

namespace berth::clouds {

/// The Point Cloud Library's own format and PLY, text and binary, through the library itself.
/// Points that are not finite are empty beams of an organised cloud: dropped, as nothing tells
/// their direction. @throws InputError.
Cloud read_pcd(const std::filesystem::path& path);
Cloud read_ply(const std::filesystem::path& path);

}  // namespace berth::clouds
