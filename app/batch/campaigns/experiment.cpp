// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/experiment.h"

#include <unistd.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "app/batch/campaigns/vocabulary.h"
#include "app/runs/choose_setup.h"
#include "app/runs/config_override.h"
#include "app/runs/run_files.h"
#include "app/runs/twin_host.h"
#include "app/runs/verdict.h"
#include "common/core/file.h"
#include "common/core/valid_text.h"
#include "estimator/estimator_options.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/words.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

using estimator::AcquisitionResult;
using trials::AcquisitionScene;

/// m, of a target without a length in the manifest: the replica's.
constexpr double default_length = 3.0;

/// What trials with one configuration and target share.
struct Subject {
  estimator::EstimatorOptions options;
  std::shared_ptr<const estimator::TargetModel> model;
  std::unique_ptr<trials::PoseJudge> judge;
};

/// The trial could not be run.
void fail(TrialResult& result, const std::string& why) {
  result.outcome = Outcome::error;
  result.failure = "error";
  result.error = why;
}

std::map<std::string, std::string> configuration_of(const Trial& trial) {
  std::map<std::string, std::string> keys;
  for (const auto* list : {&trial.fixed, &trial.parameters}) {
    for (const auto& [name, value] : *list) {
      if (names_configuration(name) || name == target_axis) keys[name] = value;
    }
  }
  return keys;
}

AcquisitionParameters parameters_of(const Trial& trial) {
  AcquisitionParameters parameters;
  parameters.scene.physics.noise.range_min_m = 1;  // a target of 3 m comes near
  for (const auto* list : {&trial.fixed, &trial.parameters}) {
    for (const auto& [name, value] : *list) {
      if (!names_configuration(name) && name != target_axis) set_parameter(parameters, name, value);
    }
  }
  return parameters;
}

std::map<std::string, double> measured(const AcquisitionScene& scene,
                                       const AcquisitionResult& result,
                                       const trials::PoseJudge& judge, std::size_t points) {
  std::map<std::string, double> values = {
      {"points", static_cast<double>(points)},
      {"hypotheses", static_cast<double>(result.hypotheses.size())}};
  if (result.hypotheses.empty()) return values;
  const Pose& pose = result.hypotheses.front().pose;
  const Pose truth = judge.nearest_equal(scene.truth, pose);
  const Vector3d position = 1e3 * (pose.position - truth.position);
  const Vector3d seen = rotation_vector(pose.rotation * truth.rotation.conjugate());
  const Vector3d own = rotation_vector(truth.rotation.conjugate() * pose.rotation);
  values["position_error"] = position.norm();
  values["attitude_error"] = degrees(seen.norm());
  values["probability"] = result.hypotheses.front().probability;
  const char* axes[] = {"x", "y", "z"};
  const char* turns[] = {"roll_error", "pitch_error", "yaw_error"};
  for (int i = 0; i < 3; ++i) {
    values[std::string(axes[i]) + "_error"] = position[i];
    values[std::string("attitude_") + axes[i] + "_error"] = degrees(seen[i]);
    values[turns[i]] = degrees(std::abs(own[i]));
  }
  return values;
}

class AcquisitionExperiment : public Experiment {
 public:
  explicit AcquisitionExperiment(const Campaign& campaign) : manifest_(campaign.manifest()) {}

  TrialResult run(const Trial& trial) override { return run(trial, nullptr); }

  TrialResult run_again(const Trial& trial, const fs::path& directory) override {
    fs::create_directories(directory);
    return run(trial, &directory);
  }

 private:
  TrialResult run(const Trial& trial, const fs::path* directory) {
    TrialResult result = result_for(trial);
    try {
      run_into(result, trial, directory);
    } catch (const std::exception& e) {
      fail(result, e.what());
    }
    return result;
  }

  void run_into(TrialResult& result, const Trial& trial, const fs::path* directory) {
    const Subject& subject = subject_of(configuration_of(trial));
    const AcquisitionParameters parameters = parameters_of(trial);
    const BeamModel& noise = parameters.scene.physics.noise;
    Random random(trial.seed, "acquisition");
    const AcquisitionScene scene = trials::make_scene(subject.model, parameters.scene, random);
    const auto method = estimator::make_acquisition(subject.options, *subject.model, noise);
    const estimator::PreprocessedScan clean = estimator::preprocess(
        scene.scan.beams, {parameters.gate_near_m, parameters.gate_far_m}, noise);
    const AcquisitionResult found = method->acquire(clean);
    const trials::Verdict verdict = trials::verdict_on(found, *subject.judge, scene.truth);
    result.attitude = scene.truth.rotation;
    result.outcome = trials::has_truth(verdict) ? Outcome::pass : Outcome::fail;
    if (!result.passed()) result.failure = trials::name_of(verdict);
    const auto all = measured(scene, found, *subject.judge, clean.points.size());
    for (const KeptMeasurement& kept : manifest_.measurements) {
      const auto value = all.find(kept.name);
      if (value != all.end()) result.measurements[kept.name] = value->second;
    }
    if (directory != nullptr) leave(*directory, scene, found, verdict);
  }

  /// The scan as a cloud for `berth estimate` and viewers, and what was made of it.
  static void leave(const fs::path& directory, const AcquisitionScene& scene,
                    const AcquisitionResult& found, trials::Verdict verdict) {
    std::string cloud;
    for (const auto& beam : scene.scan.beams) {
      if (beam.status != BeamStatus::hit) continue;
      const Vector3d p = beam.range * beam_direction(beam.azimuth, beam.elevation);
      char line[96];
      std::snprintf(line, sizeof line, "%.6f %.6f %.6f\n", p.x(), p.y(), p.z());
      cloud += line;
    }
    write_file(directory / "scan.xyz", cloud);
    nlohmann::ordered_json hypotheses = nlohmann::ordered_json::array();
    for (const auto& one : found.hypotheses) {
      hypotheses.push_back({{"xyzwpr", xyzwpr_from_pose(one.pose)},
                            {"log_likelihood", one.log_likelihood},
                            {"probability", one.probability}});
    }
    const nlohmann::ordered_json text = {{"verdict", trials::name_of(verdict)},
                                         {"reason", found.reason},
                                         {"truth_xyzwpr", xyzwpr_from_pose(scene.truth)},
                                         {"hypotheses", hypotheses}};
    write_file(directory / "acquisition.json", json_text(text, 2) + "\n");
  }

  const Subject& subject_of(const std::map<std::string, std::string>& keys) {
    const auto known = subjects_.find(keys);
    if (known != subjects_.end()) return known->second;
    // Drawn ones never come back.
    if (subjects_.size() > static_cast<std::size_t>(manifest_.points())) subjects_.clear();
    Subject subject;
    subject.options = options_with(keys);
    const CampaignTarget target = manifest_.target_of({keys.begin(), keys.end()});
    subject.model = estimator::load_target_model(
        load_target(target.place.empty() ? default_target(manifest_.places.config) : target.place,
                    target.length > 0 ? target.length : default_length),
        subject.options.model, estimator::default_cache_directory());
    subject.judge = std::make_unique<trials::PoseJudge>(*subject.model);
    return subjects_.emplace(keys, std::move(subject)).first->second;
  }

  estimator::EstimatorOptions options_with(std::map<std::string, std::string> keys) const {
    keys.erase(target_axis);
    const ChangedConfiguration changed(manifest_.places.config, keys);
    return estimator::load_estimator_options(changed.directory() / "estimator.yaml");
  }

  const Manifest manifest_;
  std::map<std::map<std::string, std::string>, Subject> subjects_;
};

/// The failure kind that trials share: the step that broke off, or else the first criterion that
/// was not met.
std::string kind_of_failure(const evaluation::Comparison& comparison) {
  const auto& steps = comparison.steps;
  const auto step = std::find_if(steps.begin(), steps.end(), went_wrong);
  if (step != steps.end()) {
    return "step '" + step->name + "' " + words::of_step_state(step->state);
  }
  for (const auto failure : {criterion_result_t::FAILED, criterion_result_t::INCONCLUSIVE}) {
    for (const criterion_result_t& criterion : comparison.criteria) {
      if (criterion.result == failure) return criterion.name;
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
      fail(result, placeless(e.what()));
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
      fail(result, placeless(e.what()));
    }
    return result;
  }

 private:
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
    if (!target.name.empty()) request.parameters.erase(target_axis);
    return request;
  }

  /// @return the run's exit code
  int run_into(TrialResult& result, const RunFiles& files) const {
    const TwinResult twin = run_twin(
        files, [](const std::string&, Bytes) {}, [] { return false; });
    const evaluation::ComparedRun run = evaluation::compare_run(files.log());
    const evaluation::Comparison& comparison = run.comparison;
    result.outcome = outcome_of_run(comparison.outcome);
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

std::unique_ptr<Experiment> make_experiment(const Campaign& campaign) {
  if (campaign.manifest().experiment == "procedure") {
    return std::make_unique<ProcedureExperiment>(campaign);
  }
  return std::make_unique<AcquisitionExperiment>(campaign);
}

fs::path work_directory_of(pid_t worker) {
  return temporary_directory() / ("berth-worker-" + std::to_string(worker));
}

}  // namespace berth::campaigns
