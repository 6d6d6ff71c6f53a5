// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <algorithm>

#include "app/batch/campaigns/experiments.h"
#include "app/runs/run_files.h"
#include "app/runs/twin_host.h"
#include "app/runs/verdict.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/words.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

Outcome outcome_of(std::int8_t outcome) {
  switch (outcome) {
    case procedure_state_t::PASS:
      return Outcome::pass;
    case procedure_state_t::FAIL:
      return Outcome::fail;
    case procedure_state_t::INCONCLUSIVE:
      return Outcome::inconclusive;
    case procedure_state_t::TIMEOUT:
      return Outcome::timeout;
    case procedure_state_t::ABORTED:
      return Outcome::aborted;
    default:
      return Outcome::error;
  }
}

bool went_wrong(const procedure_step_t& step) {
  return step.state == procedure_step_t::FAILED || step.state == procedure_step_t::ERROR ||
         step.state == procedure_step_t::TIMEOUT || step.state == procedure_step_t::ABORTED;
}

/// What many trials that failed alike have in common: the step that broke it off, or else the first
/// criterion that was not met.
std::string kind_of_failure(const evaluation::Comparison& comparison) {
  const auto& steps = comparison.steps;
  const auto step = std::find_if(steps.begin(), steps.end(), went_wrong);
  if (step != steps.end()) {
    return "step '" + step->name + "' " + words::of_step_state(step->state);
  }
  for (const auto wanted : {criterion_result_t::FAILED, criterion_result_t::INCONCLUSIVE}) {
    for (const criterion_result_t& criterion : comparison.criteria) {
      if (criterion.result == wanted) return criterion.name;
    }
  }
  return "no verdict";
}

const evaluation::Phase* phase_named(const std::vector<evaluation::Phase>& phases,
                                     const std::string& name) {
  const auto found =
      std::find_if(phases.begin(), phases.end(),
                   [&](const evaluation::Phase& phase) { return phase.name == name; });
  return found == phases.end() ? nullptr : &*found;
}

/// A directory of this process, which its parent removes when it cannot do so itself.
fs::path work_directory() {
  const fs::path directory = work_directory_of(getpid());
  fs::create_directories(directory);
  return directory;
}

class ProcedureExperiment : public Experiment {
 public:
  explicit ProcedureExperiment(const Campaign& campaign)
      : manifest_(campaign.manifest()), work_(work_directory()) {}
  ~ProcedureExperiment() override {
    std::error_code ignored;
    fs::remove_all(work_, ignored);
  }

  TrialResult run(const Trial& trial) override {
    TrialResult result = result_for(trial);
    try {
      const RunFiles files = RunFiles::create(request_for(trial, work_));
      run_into(result, files);
      std::error_code ignored;  // no trial's fault; the worker's directory goes at its end
      fs::remove_all(files.directory, ignored);
    } catch (const std::exception& e) {
      fail(result, e);
    }
    return result;
  }

  TrialResult run_again(const Trial& trial, const fs::path& directory) override {
    TrialResult result = result_for(trial);
    try {
      const RunFiles made = RunFiles::create(request_for(trial, work_));
      const int code = run_into(result, made);
      write_verdict(made, code);
      fs::create_directories(fs::absolute(directory).parent_path());
      fs::copy(made.directory, directory, fs::copy_options::recursive);
    } catch (const std::exception& e) {
      fail(result, e);
    }
    return result;
  }

 private:
  void fail(TrialResult& result, const std::exception& e) const {
    result.outcome = Outcome::error;
    result.failure = "error";
    result.error = placeless(e.what());
  }

  /// Where and when a run was made must not show in its result: "procedure.yaml:7: ..." is left.
  std::string placeless(std::string text) const {
    const std::string place = work_.string() + "/";
    for (auto at = text.find(place); at != std::string::npos; at = text.find(place, at)) {
      const auto end = text.find('/', at + place.size());
      text.erase(at, end == std::string::npos ? place.size() : end + 1 - at);
    }
    return text;
  }

  RunRequest request_for(const Trial& trial, const fs::path& out) const {
    RunRequest request;
    request.procedure = manifest_.places.procedure;
    request.layout = manifest_.layout;
    const CampaignTarget target = manifest_.target_of(trial.parameters);
    request.target = target.place;
    request.target_length = target.length;
    request.world = manifest_.world;
    request.config = manifest_.places.config;
    request.seed = trial.seed;
    request.host = "twin";
    request.out = out;
    for (const auto* list : {&trial.fixed, &trial.parameters}) {
      for (const auto& [name, value] : *list) request.parameters[name] = value;
    }
    if (!target.name.empty()) request.parameters.erase("target");
    return request;
  }

  /// @return the run's exit code
  int run_into(TrialResult& result, const RunFiles& files) const {
    const TwinResult twin = run_twin(
        files, [](const std::string&, Bytes) {}, [] { return false; });
    const evaluation::ComparedRun run = evaluation::compare_run(files.log());
    const evaluation::Comparison& comparison = run.comparison;
    result.outcome = outcome_of(comparison.outcome);
    if (!result.passed()) {
      result.failure = kind_of_failure(comparison);
      result.error = placeless(comparison.reason);
    }
    const evaluation::Measurer measurer(run.record, run.nearest);
    const auto phases = run.record.phases();
    for (const KeptMeasurement& kept : manifest_.measurements) {
      const evaluation::Phase* phase = phase_named(phases, kept.phase);
      if (phase == nullptr) continue;
      const double value = measurer.measure(*kept.measurement, kept.statistic, *phase).value;
      if (std::isfinite(value)) result.measurements[kept.name] = kept.measurement->shown(value);
    }
    return twin.exit_code;
  }

  const Manifest manifest_;
  const fs::path work_;
};

}  // namespace

std::unique_ptr<Experiment> make_procedure_experiment(const Campaign& campaign) {
  return std::make_unique<ProcedureExperiment>(campaign);
}

}  // namespace berth::campaigns
