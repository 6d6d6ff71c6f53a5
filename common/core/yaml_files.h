// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <vector>

namespace berth {

/// All files *.yaml below a directory, in order of their names.
/// @throws std::filesystem::filesystem_error
std::vector<std::filesystem::path> yaml_files(const std::filesystem::path& directory);

}  // namespace berth
