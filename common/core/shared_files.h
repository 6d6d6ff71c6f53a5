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

}  // namespace berth
