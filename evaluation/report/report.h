// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "evaluation/report/reported_run.h"

namespace berth::report {

/// Writes a run as one self-contained HTML file; several runs side by side, with links to
/// those reports of their own that are in their directories. @throws InputError when it cannot be
/// written.
void write_report(std::span<const ReportedRun> runs, const std::filesystem::path& page);

}  // namespace berth::report
