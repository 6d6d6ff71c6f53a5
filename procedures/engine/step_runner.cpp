// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/step_runner.h"

#include "procedures/engine/step_makers.h"

namespace berth::procedures {

std::unique_ptr<StepRunner> make_runner(const Step& step) {
  return std::visit([](const auto& verb) { return make(verb); }, step.verb);
}

}  // namespace berth::procedures
