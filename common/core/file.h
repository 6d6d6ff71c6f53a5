// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace berth {

/// All bytes of a file. @throws InputError when it cannot be read.
std::string read_file(const std::filesystem::path& path);

}  // namespace berth
