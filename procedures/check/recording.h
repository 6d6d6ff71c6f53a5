// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "evaluation/run/run_record.h"
#include "procedures/check/rehearsal.h"

namespace berth::procedures {

/// What a run that goes as rehearsed would record: truth with the uncertainty that the rig gives
/// it and, where asked for, estimates that are right, at the rate that the LIDAR allows.
evaluation::RunRecord forecast_record(const Rig& rig, const Rehearsal& rehearsal,
                                      bool with_estimates);

}  // namespace berth::procedures
