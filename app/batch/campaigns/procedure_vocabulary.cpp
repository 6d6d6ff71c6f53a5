// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "app/batch/campaigns/vocabulary.h"
#include "app/runs/config_override.h"
#include "common/core/error.h"
#include "common/core/text.h"
#include "evaluation/run/run_record.h"
#include "procedures/language/procedure.h"

namespace berth::campaigns {
namespace {

class ProcedureVocabulary : public Vocabulary {
 public:
  explicit ProcedureVocabulary(Places places)
      : places_(std::move(places)), procedure_(procedures::load_procedure(places_.procedure)) {}

  void check(const std::string& name, const std::string& value) const override {
    if (names_configuration(name)) {
      check_override(places_.config, name, value);
    } else {
      procedures::load_procedure(places_.procedure, {{name, value}});
    }
  }

  std::vector<std::string> required() const override { return {}; }

  KeptMeasurement measurement(const std::string& text) const override {
    return measurement_of_run(text, phases());
  }

 private:
  std::vector<std::string> phases() const {
    std::vector<std::string> names = {evaluation::whole_run};
    for (const auto& step : procedure_.steps) {
      if (std::find(names.begin(), names.end(), step.phase) == names.end()) {
        names.push_back(step.phase);
      }
    }
    return names;
  }

  Places places_;
  procedures::Procedure procedure_;
};

}  // namespace

KeptMeasurement measurement_of_run(const std::string& text,
                                   const std::vector<std::string>& phases) {
  KeptMeasurement kept;
  kept.name = text;
  kept.phase = evaluation::whole_run;
  std::string words = text;
  if (const auto in = text.find(" in "); in != std::string::npos) {
    kept.phase = text.substr(in + 4);
    words = text.substr(0, in);
    if (std::find(phases.begin(), phases.end(), kept.phase) == phases.end()) {
      throw InputError("found phase '" + kept.phase + "', expected one of: " + joined(phases));
    }
  }
  const auto space = words.rfind(' ');
  kept.measurement =
      evaluation::measurement_named(space == std::string::npos ? words : words.substr(space + 1));
  if (kept.measurement == nullptr) {
    throw InputError(
        "no such measurement, expected [STATISTIC] MEASUREMENT [in PHASE]; see "
        "berth compare --list");
  }
  kept.unit = kept.measurement->unit;
  if (space == std::string::npos) return kept;
  const auto statistic = evaluation::statistic_named(words.substr(0, space));
  if (!statistic || !kept.measurement->series) {
    throw InputError("found '" + words.substr(0, space) + "', expected " +
                     (kept.measurement->series ? "one of: " + joined(evaluation::statistic_names())
                                               : "no statistic: it is one number"));
  }
  kept.statistic = *statistic;
  return kept;
}

std::unique_ptr<Vocabulary> vocabulary_of_procedure(const Places& places) {
  return std::make_unique<ProcedureVocabulary>(places);
}

}  // namespace berth::campaigns
