// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace berth {

/// All bytes of a file. @throws InputError when it cannot be read.
std::string read_file(const std::filesystem::path& path);

/// Puts a file into its place whole: whatever happens meanwhile, a power cut too, afterwards there
/// is either what was there before or all that is given. It is on the disk when this returns.
/// @throws InputError when it cannot be written.
void write_file(const std::filesystem::path& path, std::string_view content);

/// Where files that do not outlive a program go: TMPDIR, else /tmp.
/// @throws InputError when there is no such directory.
std::filesystem::path temporary_directory();

/// Brings a file, or a directory's list of files, to the disk. @throws InputError.
void sync_to_disk(const std::filesystem::path& path);

}  // namespace berth
