// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "app/batch/campaigns/acquisition_parameters.h"
#include "app/batch/campaigns/vocabulary.h"
#include "app/runs/config_override.h"
#include "common/core/error.h"

namespace berth::campaigns {
namespace {

/// Only what the estimator reads: there is no cell.
constexpr char estimator_file[] = "estimator.yaml:";

class AcquisitionVocabulary : public Vocabulary {
 public:
  explicit AcquisitionVocabulary(Places places) : places_(std::move(places)) {}

  void check(const std::string& name, const std::string& value) const override {
    if (names_configuration(name)) {
      if (name.rfind(estimator_file, 0) != 0) {
        throw InputError("an acquisition reads no other file of config/ than estimator.yaml");
      }
      check_override(places_.config, name, value);
      return;
    }
    AcquisitionParameters parameters;
    set_parameter(parameters, name, value);
  }

  std::vector<std::string> required() const override { return {"returns", "attitude"}; }

  KeptMeasurement measurement(const std::string& text) const override {
    for (const AcquisitionMeasurement& known : acquisition_measurements()) {
      if (text != known.name) continue;
      KeptMeasurement kept;
      kept.name = text;
      kept.unit = known.unit;
      return kept;
    }
    std::string names;
    for (const AcquisitionMeasurement& known : acquisition_measurements()) {
      names += std::string(names.empty() ? "" : ", ") + known.name;
    }
    throw InputError("no measurement of an acquisition, expected one of: " + names);
  }

 private:
  Places places_;
};

}  // namespace

std::unique_ptr<Vocabulary> vocabulary_of_acquisition(const Places& places) {
  return std::make_unique<AcquisitionVocabulary>(places);
}

}  // namespace berth::campaigns
