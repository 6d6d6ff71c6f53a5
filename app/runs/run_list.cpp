// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/run_list.h"

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/runs/active_runs.h"
#include "app/runs/manifest.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/nan.h"
#include "common/core/quantity.h"
#include "common/core/utc.h"
#include "evaluation/run/outcome.h"

namespace berth {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

/// Null where there is no such file, or it is no JSON.
json read_json(const fs::path& file) {
  std::error_code unseen;
  if (!fs::exists(file, unseen)) return nullptr;
  return json::parse(read_file(file), nullptr, false);
}

std::string text_in(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

double number_in(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : nan;
}

std::uintmax_t size_of(const fs::path& directory) {
  std::uintmax_t sum = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator at(directory, error), end; at != end; at.increment(error)) {
    if (error) break;
    const std::uintmax_t size = at->is_regular_file(error) ? at->file_size(error) : 0;
    if (!error) sum += size;
  }
  return sum;
}

void take_manifest(const json& manifest, RunEntry& run) {
  run.created = text_in(manifest, "created");
  run.host = text_in(manifest, "host");
  run.procedure = fs::path(text_in(manifest, "procedure")).stem().string();
  run.layout = text_in(manifest, "layout");
  run.target = text_in(manifest, "target");
  run.operator_name = text_in(manifest, "operator");
  run.seed = manifest.value("seed", std::int64_t{0});
  if (manifest.contains("versions")) run.version = text_in(manifest["versions"], "berth");
}

void take_results(const json& results, RunEntry& run) {
  run.outcome = text_in(results, "outcome");
  run.reason = text_in(results, "reason");
  run.duration_s = number_in(results, "duration_s");
  double worst = std::numeric_limits<double>::infinity();
  for (const json& criterion : results.value("criteria", json::array())) {
    const double margin = number_in(criterion, "margin");
    const double lower = std::abs(number_in(criterion, "min"));
    const double upper = std::abs(number_in(criterion, "max"));
    const double limit = std::isnan(lower)   ? upper
                         : std::isnan(upper) ? lower
                                             : std::max(lower, upper);
    const double share = limit > 0 ? margin / limit : margin;
    if (std::isnan(share) || share >= worst) continue;
    worst = share;
    run.worst_criterion = text_in(criterion, "name");
    run.worst_margin = margin;
    run.worst_unit = text_in(criterion, "unit");
  }
}

/// False where running processes cannot be listed: the outcome of the run is then unknown.
bool is_running(const fs::path& directory) {
  try {
    return find_active_run(directory).has_value();
  } catch (const InputError&) {
    return false;
  }
}

/// All that look like runs. What cannot be looked into, as another user's folder, is none.
std::vector<fs::path> runs_in(const fs::path& parent) {
  std::vector<fs::path> runs;
  std::error_code error;
  for (fs::directory_iterator at(parent, error), end; !error && at != end; at.increment(error)) {
    std::error_code unseen;
    if (fs::exists(at->path() / "run.yaml", unseen)) runs.push_back(at->path());
  }
  if (error) throw InputError(parent.string() + ": cannot be read: " + error.message());
  return runs;
}

void read_entry(RunEntry& run) {
  const json manifest = read_json(run.directory / manifest_file);
  if (manifest.is_object()) take_manifest(manifest, run);
  const json results = read_json(run.directory / "results.json");
  if (is_running(run.directory)) {
    run.state = RunEntry::State::running;
  } else if (results.is_object() && !text_in(results, "outcome").empty()) {
    run.state = RunEntry::State::finished;
    take_results(results, run);
  } else if (run.procedure.empty()) {
    run.reason = "a cell without a procedure";
  } else if (!fs::exists(run.directory / "run.lcm")) {
    run.reason = "nothing was recorded";
  } else {
    run.reason = "ended without a verdict; berth compare judges what was recorded";
  }
  if (manifest.is_discarded()) run.reason = "manifest.json is damaged";
  if (results.is_discarded()) run.reason = "results.json is damaged";
}

}  // namespace

RunEntry read_run_entry(const fs::path& directory) {
  RunEntry run;
  run.directory = directory;
  run.duration_s = nan;
  run.bytes = size_of(directory);
  try {
    read_entry(run);
  } catch (const std::exception& e) {
    run.reason = e.what();
  }
  return run;
}

std::vector<RunEntry> list_runs(const fs::path& parent) {
  if (!fs::is_directory(parent)) throw InputError(parent.string() + ": no such directory of runs");
  std::vector<RunEntry> runs;
  for (const fs::path& run : runs_in(parent)) runs.push_back(read_run_entry(run));
  // Directories are named by their time; those of one second by their number.
  std::sort(runs.begin(), runs.end(),
            [](const RunEntry& a, const RunEntry& b) { return a.name() < b.name(); });
  return runs;
}

std::string state_text(const RunEntry& run) {
  if (run.state == RunEntry::State::running) return "RUNNING";
  return run.state == RunEntry::State::finished ? run.outcome : "UNFINISHED";
}

fs::path find_run(const std::string& text, const fs::path& parent) {
  std::error_code unseen;
  if (fs::exists(text, unseen)) return text;
  std::vector<fs::path> found;
  if (fs::is_directory(parent)) {
    for (const fs::path& run : runs_in(parent)) {
      const std::string name = run.filename().string();
      if (name == text) return run;
      if (text == "last" || name.find(text) != std::string::npos) found.push_back(run);
    }
  }
  std::sort(found.begin(), found.end());
  if (found.empty()) {
    throw InputError("run '" + text + "': no such directory or log, and no run of that name in " +
                     parent.string() + " (berth runs lists them)");
  }
  if (text != "last" && found.size() > 1) {
    throw InputError("run '" + text + "': " + std::to_string(found.size()) + " runs have that in " +
                     "their names, the newest is " + found.back().filename().string());
  }
  return found.back();
}

fs::path log_of_run(const std::string& text, const fs::path& parent) {
  const fs::path run = find_run(text, parent);
  if (!fs::is_directory(run)) return run;
  if (fs::exists(run / "run.lcm")) return run / "run.lcm";
  throw InputError("run '" + text + "': " + run.string() +
                   " has no run.lcm, expected a log or the directory of a run that was recorded");
}

fs::path directory_of_run(const std::string& text, const fs::path& parent) {
  const fs::path found = find_run(text, parent);
  const fs::path run = fs::is_directory(found) ? found : fs::absolute(found).parent_path();
  if (fs::exists(run / "run.yaml")) return run;
  throw InputError("run '" + text + "': " + run.string() +
                   " has no run.yaml, expected the directory of a run");
}

std::optional<std::int8_t> recorded_outcome(const fs::path& directory) {
  const json results = read_json(directory / "results.json");
  if (!results.is_object()) return std::nullopt;
  return evaluation::outcome_named(text_in(results, "outcome"));
}

namespace {

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

/// The earliest time as it would be written; ISO times sort as text.
std::string earliest(const std::string& since) {
  const auto is_digit = [&](std::size_t i) {
    return std::isdigit(static_cast<unsigned char>(since[i])) != 0;
  };
  if (since.size() >= 10 && is_digit(0) && is_digit(3) && since[4] == '-' && since[7] == '-') {
    return since;
  }
  double ago = 0;
  const auto days = since.find(" day");
  try {
    ago = days != std::string::npos ? 86400 * std::stod(since.substr(0, days))
                                    : parse_quantity(since, Dimension::time);
  } catch (const std::exception&) {
    throw InputError("--since: found '" + since +
                     "', expected a date such as 2026-11-20, or a time such as '12 h' or '3 days'");
  }
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  return utc_text(now - static_cast<std::time_t>(ago));
}

}  // namespace

std::vector<RunEntry> matching(const std::vector<RunEntry>& runs, const RunFilter& filter,
                               std::size_t limit) {
  const std::string from = filter.since.empty() ? "" : earliest(filter.since);
  std::vector<RunEntry> found;
  for (const RunEntry& run : runs) {
    if (run.procedure.find(filter.procedure) == std::string::npos) continue;
    if (run.host.find(filter.host) == std::string::npos) continue;
    if (!filter.outcome.empty() && state_text(run) != upper(filter.outcome)) continue;
    if (run.created < from) continue;
    found.push_back(run);
  }
  if (limit != 0 && found.size() > limit) {
    found.erase(found.begin(), found.end() - static_cast<std::ptrdiff_t>(limit));
  }
  return found;
}

}  // namespace berth
