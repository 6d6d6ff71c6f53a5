// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/report/reported_run.h"

namespace berth::report {

/// A chart of a procedure's figure with the curves of these runs and, as level lines and a band,
/// what the criteria of the first one allow.
Chart chart_of(const evaluation::FigureChart& figure, const Views& views);

}  // namespace berth::report
