// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace berth {

/// Where the shipped config/, procedures/ and targets/ are: BERTH_HOME, or found from the program's
/// place.
/// @throws InputError when there are none.
std::filesystem::path shared_files();

/// Directory of the running program, where its sister programs are.
std::filesystem::path program_directory();

/// Where a file or directory that a user names is: as named when that is there, else among those
/// that are shipped (shared_files()), else as named. So `procedures/approach.yaml` is found from
/// any directory.
/// @throws InputError as shared_files(), when it is not there as named.
std::filesystem::path here_or_shipped(const std::filesystem::path& path);

/// Copies a file, or a directory with all that is in it, over what is there. The owner may write
/// the copies even where the originals are for reading alone, as installed files may be.
/// @throws std::filesystem::filesystem_error
void copy_writable(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace berth
