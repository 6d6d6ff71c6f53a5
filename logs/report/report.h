// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "logs/report/reported_run.h"

namespace berth::report {

/// Writes a run as one self-contained HTML file; several runs beside each other, each with a report
/// of its own below. @throws InputError when it cannot be written.
void write_report(std::span<const ReportedRun> runs, const std::filesystem::path& page);

}  // namespace berth::report
