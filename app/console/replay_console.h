// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "app/console/server/server.h"

namespace berth::console {

/// Serves a recorded run, or two side by side, until SIGINT or SIGTERM; prints its address on
/// stdout. Every viewer may play and seek: it is one replay for all. @throws InputError
void serve_replay(const std::filesystem::path& run, const std::filesystem::path& second,
                  ServerOptions options);

}  // namespace berth::console
