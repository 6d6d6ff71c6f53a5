// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "procedures/engine/step_runner.h"

namespace berth::procedures {

/// The runner of each verb.
std::unique_ptr<StepRunner> make(const Lights& lights);
std::unique_ptr<StepRunner> make(const Move& move);
std::unique_ptr<StepRunner> make(const Retreat& retreat);
std::unique_ptr<StepRunner> make(const Trajectory& trajectory);
std::unique_ptr<StepRunner> make(const Acquire& acquire);
std::unique_ptr<StepRunner> make(const Track& track);
std::unique_ptr<StepRunner> make(const Approach& approach);
std::unique_ptr<StepRunner> make(const Hold& hold);
std::unique_ptr<StepRunner> make(const Guided& guided);
std::unique_ptr<StepRunner> make(const Wait& wait);
std::unique_ptr<StepRunner> make(const WaitUntil& wait);
std::unique_ptr<StepRunner> make(const Dwell& dwell);
std::unique_ptr<StepRunner> make(const Scan& scan);
std::unique_ptr<StepRunner> make(const Prompt& prompt);
std::unique_ptr<StepRunner> make(const Annotate& annotate);
std::unique_ptr<StepRunner> make(const Record& record);
std::unique_ptr<StepRunner> make(const Inject& inject);
std::unique_ptr<StepRunner> make(const ClearInjections& clear);
std::unique_ptr<StepRunner> make(const StopTracking& stop);

}  // namespace berth::procedures
