// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/trial_store.h"

#include <array>
#include <cstdio>
#include <cstdlib>

#include "common/core/error.h"
#include "common/core/text.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

const std::string parameter_prefix = "parameters.";

/// How a kept measurement is named in the store: as those of any run, without its value.
RunValue quantity_of(const KeptMeasurement& kept) {
  if (kept.measurement == nullptr) return {"", kept.name, "value", kept.unit, 0, 0};
  const std::string statistic =
      kept.measurement->series ? evaluation::name_of(kept.statistic) : "value";
  return {kept.phase, kept.measurement->name, statistic, kept.unit, 0, 0};
}

bool same_quantity(const RunValue& a, const RunValue& b) {
  return a.phase == b.phase && a.measurement == b.measurement && a.statistic == b.statistic;
}

/// "returns 50, range_noise 10 mm"
std::string case_of(const Manifest& manifest, const TrialResult& trial) {
  std::vector<std::string> words;
  for (std::size_t axis = 0; axis < manifest.grid.size(); ++axis) {
    const auto& [name, value] = trial.parameters[axis];
    words.push_back(name + " " + value);
  }
  return joined(words);
}

FinishedRun run_of(const Manifest& manifest, const TrialResult& trial) {
  FinishedRun run;
  static_cast<TaskResult&>(run) = trial;
  run.case_name = case_of(manifest, trial);
  run.procedure = manifest.places.procedure.filename().string();
  run.target = manifest.target_of(trial.parameters).place;
  run.host = "twin";
  for (const KeptMeasurement& kept : manifest.measurements) {
    const auto found = trial.measurements.find(kept.name);
    if (found == trial.measurements.end()) continue;
    run.values.push_back(quantity_of(kept));
    run.values.back().value = found->second;
    run.values.back().samples = 1;
  }
  run.details = {{"trial", std::to_string(trial.index)},
                 {"point", std::to_string(trial.point)},
                 {"failure", trial.failure}};
  for (const auto& [name, value] : trial.parameters) run.details[parameter_prefix + name] = value;
  if (trial.attitude) {
    const Quaterniond& q = *trial.attitude;
    std::array<char, 128> text{};
    std::snprintf(text.data(), text.size(), "%.17g %.17g %.17g %.17g", q.w(), q.x(), q.y(), q.z());
    run.details["attitude_wxyz"] = text.data();
  }
  return run;
}

Quaterniond attitude_of(const std::string& text) {
  std::array<double, 4> wxyz{};
  const char* at = text.c_str();
  for (double& number : wxyz) {
    char* end = nullptr;
    number = std::strtod(at, &end);
    at = end;
  }
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

/// @throws std::exception when it is of something else than a trial
TrialResult trial_of_run(const Manifest& manifest, const FinishedRun& run) {
  TrialResult trial;
  static_cast<TaskResult&>(trial) = run;
  trial.index = std::stoll(run.details.at("trial"));
  trial.point = std::stoll(run.details.at("point"));
  trial.failure = run.details.at("failure");
  for (const auto* list : {&manifest.grid, &manifest.drawn}) {
    for (const Parameter& parameter : *list) {
      trial.parameters.emplace_back(parameter.name,
                                    run.details.at(parameter_prefix + parameter.name));
    }
  }
  const auto attitude = run.details.find("attitude_wxyz");
  if (attitude != run.details.end()) trial.attitude = attitude_of(attitude->second);
  for (const KeptMeasurement& kept : manifest.measurements) {
    for (const RunValue& value : run.values) {
      const bool measured = !std::isnan(value.value);
      if (measured && same_quantity(value, quantity_of(kept))) {
        trial.measurements[kept.name] = value.value;
      }
    }
  }
  return trial;
}

}  // namespace

TrialWriter::TrialWriter(const Manifest& manifest, const fs::path& file, BatchRecord batch)
    : manifest_(manifest),
      file_(file),
      unfinished_(file.string() + ".unfinished"),
      batch_(std::move(batch)) {
  fs::remove(unfinished_);
  store_.emplace(unfinished_);
  store_->begin(batch_);
}

void TrialWriter::add(const std::vector<TrialResult>& trials) {
  std::vector<FinishedRun> runs;
  for (const TrialResult& trial : trials) {
    runs.push_back(run_of(manifest_, trial));
    runs.back().version = batch_.version;
  }
  store_->record(batch_, runs);
}

void TrialWriter::finish() {
  store_->finish(batch_, {});
  store_.reset();
  fs::rename(unfinished_, file_);
}

void for_each_trial(const Manifest& manifest, const fs::path& file,
                    const std::function<void(const TrialResult&)>& each) {
  if (!fs::exists(file)) {
    throw InputError(file.string() + ": is missing; 'berth campaign merge DIRECTORY' makes it");
  }
  ResultStore store(file);
  for (const BatchRecord& batch : store.batches()) {
    store.for_each_run(batch, ResultStore::Which::all, [&](const FinishedRun& run) {
      TrialResult trial;
      try {
        trial = trial_of_run(manifest, run);
      } catch (const std::exception&) {
        throw InputError(file.string() + ": holds another run than a trial of this campaign: " +
                         run.case_name + ", seed " + std::to_string(run.seed));
      }
      each(trial);
    });
  }
}

}  // namespace berth::campaigns
