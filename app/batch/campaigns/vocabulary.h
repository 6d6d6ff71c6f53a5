// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/batch/campaigns/manifest.h"
#include "evaluation/trials/acquisition_trial.h"

namespace berth::campaigns {

/// Parameters and measurements of a manifest's experiment.
class Vocabulary {
 public:
  virtual ~Vocabulary() = default;

  /// @throws InputError when there is no such parameter, or the value is none for it.
  virtual void check(const std::string& name, const std::string& value) const = 0;
  /// Parameters that must be given.
  virtual std::vector<std::string> required() const = 0;
  /// A measurement as a manifest names it. @throws InputError.
  virtual KeptMeasurement measurement(const std::string& text) const = 0;
};

/// @throws InputError where what is named is not there.
std::unique_ptr<Vocabulary> vocabulary_of_procedure(const Places& places);
std::unique_ptr<Vocabulary> vocabulary_of_acquisition(const Places& places);

/// Parameters of a single acquisition.
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

/// A measurement of one. Errors are as in docs/measurements.md, of the best hypothesis; against
/// the nearest of the poses that show the same surface as the truth.
struct AcquisitionMeasurement {
  const char* name;
  const char* unit;
  const char* description;
};
const std::vector<AcquisitionMeasurement>& acquisition_measurements();

}  // namespace berth::campaigns
