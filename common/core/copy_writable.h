// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace berth {

/// Copies a file, or a directory with all that is in it, over what is there. The owner may write
/// the copies even where the originals are for reading alone, as installed files may be.
/// @throws std::filesystem::filesystem_error
void copy_writable(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace berth
