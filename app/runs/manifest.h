// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/runs/run_files.h"

namespace berth {

/// The provenance of a run: operator, place and time, versions, and the hashes of all files that
/// are there before it starts. In a file of its own, on which no number of the run depends.
inline constexpr char manifest_file[] = "manifest.json";

/// Copies the message definitions into the run's types/ and writes manifest.json. Everything known
/// before the start is then on the disk.
/// @param request of the operator, as received
/// @throws InputError when something cannot be read or written.
void write_manifest(const RunFiles& files, const RunRequest& request);

/// The operator's name: BERTH_OPERATOR, else that of the user who runs this process.
std::string default_operator();

/// The last file that a run writes: SHA-256 of all its others, as sha256sum -c reads it.
inline constexpr char checksums_file[] = "SHA256SUMS";

/// Writes SHA256SUMS. What the log is still to be written to, the supervisor's own output, is left
/// out. @throws InputError when a file cannot be read or written.
void write_checksums(const std::filesystem::path& run);

/// What is wrong with the files of a run against its SHA256SUMS: changed, missing, not listed.
/// Empty: all is as it was. @throws InputError when there is no SHA256SUMS.
std::vector<std::string> verify_checksums(const std::filesystem::path& run);

}  // namespace berth
