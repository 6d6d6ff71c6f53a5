// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace berth {

/// The last file that a run writes: SHA-256 of all its others, as sha256sum -c reads it.
inline constexpr char checksums_file[] = "SHA256SUMS";

/// Writes SHA256SUMS. What the log is still to be written to, the supervisor's own output, is left
/// out. @throws InputError when a file cannot be read or written.
void write_checksums(const std::filesystem::path& run);

/// What is wrong with the files of a run against its SHA256SUMS: changed, missing, not listed.
/// Empty: all is as it was. @throws InputError when there is no SHA256SUMS.
std::vector<std::string> verify_checksums(const std::filesystem::path& run);

}  // namespace berth
