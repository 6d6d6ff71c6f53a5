// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace berth {

/// SHA-256 as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);
/// Of a file's content. @throws InputError when it cannot be read.
std::string sha256_of_file(const std::filesystem::path& path);
/// Over what is given first, and names and contents of all files below a directory.
std::string sha256_of_tree(const std::filesystem::path& root, const std::string& first);

}  // namespace berth
