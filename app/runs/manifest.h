// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "app/runs/run_files.h"

namespace berth {

/// What a run was made with: who, where and when, versions, and the hashes of all files that are
/// there before it starts. In a file of its own, which no number of the run depends on.
inline constexpr char manifest_file[] = "manifest.json";

/// Copies the message definitions into the run's types/ and writes manifest.json. Everything known
/// before the start is then on the disk.
/// @param request the operator's wishes, as they came
/// @throws InputError when something cannot be read or written.
void write_manifest(const RunFiles& files, const RunRequest& request);

/// The operator's name: BERTH_OPERATOR, else that of the user who runs this.
std::string default_operator();

}  // namespace berth
