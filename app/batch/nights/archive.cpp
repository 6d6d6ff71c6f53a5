// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/nights/archive.h"

#include <algorithm>
#include <cmath>
#include <limits>
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

double number(const nlohmann::json& value) {
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

/// From what `berth reestimate --json` prints.
ArchiveResult archive_result(const std::string& text, const evaluation::MinimumEffect& minimum) {
  const auto json = nlohmann::json::parse(text);
  ArchiveResult result;
  for (const auto& entry : json.at("runs")) {
    ArchivedRun& run = result.runs.emplace_back();
    const fs::path log = entry.at("recorded").get<std::string>();
    run.name = log.parent_path().filename().string();
    run.error = entry.value("error", "");
    if (!run.error.empty()) continue;
    run.estimates = entry.at("estimates");
    run.same = entry.at("estimates_same");
    run.verdict = entry.at("change").at("verdict");
  }
  for (const auto& row : json.at("change").at("rows")) {
    const std::string judgement = row.at("judgement");
    if (judgement != "better" && judgement != "worse") continue;
    FlaggedChange change;
    change.against = "recorded";
    change.case_name = "archive";
    change.phase = row.at("phase");
    change.measurement = row.at("measurement");
    change.statistic = row.at("statistic");
    change.unit = row.at("unit");
    change.before = number(row.at("recorded"));
    change.after = number(row.at("again"));
    change.low = number(row.at("interval").at(0));
    change.high = number(row.at("interval").at(1));
    change.p = number(row.at("p_adjusted"));
    change.kind = judgement;
    change.runs = json.at("change").at("runs");
    const double effect = minimum.of(change.measurement, std::abs(change.before));
    if (std::abs(change.after - change.before) >= effect) result.changes.push_back(change);
  }
  return result;
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
  std::error_code ignored;
  fs::remove_all(out, ignored);
  try {
    const ArchiveResult result = archive_result(output.text, plan.minimum_effect);
    write_file(night / "archive.json", output.text);
    return result;
  } catch (const nlohmann::json::exception&) {
    ArchivedRun none;
    none.name = plan.archive.runs.string();
    none.error = "berth reestimate " + output.end.text() + ": " + output.errors;
    return {{none}, {}};
  }
}

}  // namespace berth::nights
