// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "common/clouds/cloud.h"

namespace berth::clouds {

/// A PCD file (the Point Cloud Library's own format, 0.5 to 0.7): text, binary, compressed. It must
/// hold what its header declares. Points that are no numbers are empty beams of an organised
/// cloud. The viewpoint is not used, with a note. file: for messages. @throws InputError.
Cloud parse_pcd(std::string_view bytes, const std::string& file, const CloudOptions& options);

/// The vertices of a PLY file; other elements, and lists, do not matter. file: for messages.
/// @throws InputError naming line or byte.
Cloud parse_ply(std::string_view bytes, const std::string& file, const CloudOptions& options);

/// One scan in Leica's PTX: columns, rows, the scanner's position and axes, a 4x4 matrix, then a
/// beam a line, x y z intensity [r g b], column by column. Points are taken unchanged, in the
/// scanner's own frame; the poses are not used. 0 0 0 is a beam that nothing came back from: a miss
/// whose direction follows from the grid of the other beams. A second scan in the file is an error:
/// it was taken from another place. file: for messages. @throws InputError.
Cloud parse_ptx(std::string_view text, const std::string& file, const CloudOptions& options);

}  // namespace berth::clouds
