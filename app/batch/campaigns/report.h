// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/manifest.h"

namespace berth::campaigns {

/// Writes report.html, one file that needs nothing else, and report.json, its numbers, from the
/// results.sqlite of a campaign's directory; of a campaign that is not complete, what is there.
/// @param manifest of the campaign, as run
/// @throws InputError when there are no trials, or a file cannot be read or written.
void write_report(const Manifest& manifest, const std::filesystem::path& directory);

}  // namespace berth::campaigns
