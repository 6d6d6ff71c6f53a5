// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/archive.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/core/child_process.h"
#include "common/core/file.h"
#include "common/core/text.h"

namespace berth::nights {
namespace fs = std::filesystem;
namespace {

std::vector<std::string> runs_in(const fs::path& directory) {
  std::vector<std::string> runs;
  for (const auto& entry : fs::directory_iterator(directory)) {
    if (entry.is_directory()) runs.push_back(entry.path().string());
  }
  std::sort(runs.begin(), runs.end());
  return runs;
}

/// From what `berth reestimate --json` prints.
std::vector<ArchivedRun> archived_runs(const std::string& text) {
  std::vector<ArchivedRun> runs;
  const auto json = nlohmann::json::parse(text);
  for (const auto& entry : json.at("runs")) {
    ArchivedRun& run = runs.emplace_back();
    const fs::path log = entry.at("recorded").get<std::string>();
    run.name = log.parent_path().filename().string();
    run.error = entry.value("error", "");
    if (!run.error.empty()) continue;
    run.estimates = entry.at("estimates");
    run.same = entry.at("estimates_same");
    run.verdict = entry.at("change").at("verdict");
  }
  return runs;
}

/// From the results that it leaves: what changed by more than the plan's minimum effect.
std::vector<FlaggedChange> flagged_changes(const fs::path& results,
                                           const evaluation::MinimumEffect& minimum) {
  ResultStore store(results);
  const auto batches = store.batches();
  if (batches.empty()) return {};
  auto changes = store.changes(batches.back());
  std::erase_if(changes, [&](const FlaggedChange& change) {
    const double effect = minimum.of(change.measurement, std::abs(change.before));
    return std::abs(change.after - change.before) < effect;
  });
  for (FlaggedChange& change : changes) change.case_name = "archive";
  return changes;
}

}  // namespace

bool ArchiveResult::failed() const {
  return std::any_of(runs.begin(), runs.end(),
                     [](const ArchivedRun& run) { return !run.error.empty(); });
}

ArchiveResult estimate_archive(const Plan& plan, const fs::path& program, const fs::path& night) {
  if (plan.archive.runs.empty()) return {};
  const fs::path out = night / "archive";
  std::vector<std::string> words{program.string(),
                                 "reestimate",
                                 "--json",
                                 "--jobs",
                                 std::to_string(plan.jobs),
                                 "--level",
                                 fixed(std::clamp(plan.family_wise_alpha, 1e-4, 0.5), 6),
                                 "--out",
                                 out.string()};
  if (!plan.archive.config.empty()) {
    words.insert(words.end(), {"--config", plan.archive.config.string()});
  }
  for (const std::string& run : runs_in(plan.archive.runs)) words.push_back(run);
  const ProgramOutput output = run_program(words);
  ArchiveResult result;
  try {
    result.runs = archived_runs(output.text);
    result.changes = flagged_changes(out / "results.sqlite", plan.minimum_effect);
    write_file(night / "archive.json", output.text);
  } catch (const nlohmann::json::exception&) {
    ArchivedRun none;
    none.name = plan.archive.runs.string();
    none.error = "berth reestimate " + output.end.text() + ": " + output.errors;
    result.runs = {none};
  }
  std::error_code ignored;
  fs::remove_all(out, ignored);
  return result;
}

}  // namespace berth::nights
