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

}  // namespace berth::clouds
