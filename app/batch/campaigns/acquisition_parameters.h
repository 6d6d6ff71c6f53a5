// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "evaluation/trials/acquisition_trial.h"

namespace berth::campaigns {

/// What a single acquisition may be told.
struct AcquisitionParameters {
  trials::SceneWishes scene;
  double gate_near_m = 1;  ///< the range gate
  double gate_far_m = 15;
};

/// Sets one by its name: "returns", "range", "range_noise" ... from text such as "20 mm".
/// @throws InputError when there is no such parameter, or the value is none for it.
void set_parameter(AcquisitionParameters& parameters, const std::string& name,
                   const std::string& value);

/// Parameters and measurements as tables, for docs/campaigns.md and the terminal.
std::string describe_acquisition();

/// What can be kept of one. Errors are as in docs/measurements.md, of the best hypothesis; against
/// the nearest of the poses that show the same surface as the truth.
struct AcquisitionMeasurement {
  const char* name;
  const char* unit;
  const char* description;
};
const std::vector<AcquisitionMeasurement>& acquisition_measurements();

}  // namespace berth::campaigns
