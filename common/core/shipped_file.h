// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

namespace berth {

/// Where a file or directory that a user names is: as named when that is there, else among those
/// that are shipped (shared_files()), else as named. So `procedures/approach.yaml` is found from
/// any directory.
/// @throws InputError as shared_files(), when it is not there as named.
std::filesystem::path here_or_shipped(const std::filesystem::path& path);

}  // namespace berth
