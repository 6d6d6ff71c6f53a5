// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/results.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/batch/campaigns/trial_store.h"
#include "app/host_name.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::campaigns {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

template <class Each>
void for_each_line(const std::string& text, const Each& each) {
  std::size_t from = 0;
  for (std::size_t to = text.find('\n'); to != std::string::npos; to = text.find('\n', from)) {
    each(text.substr(from, to - from));
    from = to + 1;
  }
}

/// From a file that may end in the middle of a line: its whole lines. Empty when there is no file.
std::vector<TrialResult> read_whole_lines(const fs::path& file) {
  std::vector<TrialResult> results;
  if (!fs::exists(file)) return results;
  try {
    for_each_line(read_file(file), [&](const std::string& line) {
      results.push_back(result_of_line(line, file.string()));
    });
  } catch (const InputError&) {
    // What comes behind a damaged line cannot be trusted either.
  }
  return results;
}

/// @throws InputError.
std::vector<TrialResult> read_block(const fs::path& file, const std::string& text) {
  std::vector<TrialResult> results;
  for_each_line(text, [&](const std::string& line) {
    results.push_back(
        result_of_line(line, file.string() + ":" + std::to_string(results.size() + 1)));
  });
  return results;
}

bool is_broken(Outcome outcome) { return outcome == Outcome::error || outcome == Outcome::crashed; }

void count(const std::vector<TrialResult>& results, const Block& block, Summary& summary) {
  std::int64_t expected = block.begin;
  for (const TrialResult& result : results) {
    if (result.index != expected++) throw InputError("the trials are not those of the block");
    ++summary.present;
    ++summary.outcomes[result.outcome];
    if (!result.passed()) ++summary.failures[result.failure];
    if (is_broken(result.outcome)) summary.broken.push_back(result.index);
  }
  if (expected != block.end) throw InputError("trials are missing from the block");
}

void write_summary(const Campaign& campaign, const Summary& summary) {
  ordered_json outcomes = ordered_json::object();
  for (const auto& [outcome, number] : summary.outcomes) outcomes[name_of(outcome)] = number;
  ordered_json missing = ordered_json::array();
  for (const Block& block : summary.missing) missing.push_back({block.begin, block.end});
  const ordered_json json = {{"schema", "berth-campaign-summary-1"},
                             {"name", campaign.manifest().name},
                             {"trials", summary.trials},
                             {"present", summary.present},
                             {"outcomes", outcomes},
                             {"failures", summary.failures},
                             {"missing", missing},
                             {"broken", summary.broken}};
  write_file(campaign.directory() / "summary.json", json_text(json, 2) + "\n");
}

}  // namespace

std::string line_of(const TrialResult& result) {
  ordered_json parameters = ordered_json::object();
  for (const auto& [name, value] : result.parameters) parameters[name] = value;
  ordered_json measurements = ordered_json::object();
  for (const auto& [name, value] : result.measurements) measurements[name] = value;
  ordered_json line = {{"trial", result.index},
                       {"point", result.point},
                       {"seed", result.seed},
                       {"parameters", parameters}};
  if (result.attitude) {
    const Quaterniond& q = *result.attitude;
    line["attitude_wxyz"] = {q.w(), q.x(), q.y(), q.z()};
  }
  line["outcome"] = name_of(result.outcome);
  line["failure"] = result.failure;
  line["measurements"] = measurements;
  line["error"] = result.error;
  return json_text(line);
}

TrialResult result_of_line(const std::string& line, const std::string& where) {
  TrialResult result;
  try {
    const ordered_json json = ordered_json::parse(line);
    result.index = json.at("trial");
    result.point = json.at("point");
    result.seed = json.at("seed");
    for (const auto& [name, value] : json.at("parameters").items()) {
      result.parameters.emplace_back(name, value);
    }
    if (json.contains("attitude_wxyz")) {
      const auto& q = json.at("attitude_wxyz");
      result.attitude = Quaterniond(q.at(0), q.at(1), q.at(2), q.at(3));
    }
    const std::string outcome = json.at("outcome");
    const auto known = outcome_named(outcome);
    if (!known)
      throw InputError(where + ": found outcome '" + outcome + "', expected PASS, FAIL ...");
    result.outcome = *known;
    result.failure = json.at("failure");
    for (const auto& [name, value] : json.at("measurements").items()) {
      if (value.is_number()) result.measurements[name] = value;
    }
    result.error = json.at("error");
  } catch (const nlohmann::json::exception& e) {
    throw InputError(where + ": expected the result of a trial: " + e.what());
  }
  return result;
}

BlockWriter::BlockWriter(const Campaign& campaign, const Block& block)
    : block_file_(campaign.block_file(block)),
      started_file_(campaign.started_file(block)),
      file_(open(started_file_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644)),
      next_(block.begin) {
  if (file_ < 0) throw InputError(started_file_.string() + ": cannot be written");
  if (flock(file_, LOCK_EX | LOCK_NB) != 0) {
    close(file_);
    throw InputError(started_file_.string() + ": another berth is at work on these trials");
  }
  std::string lines;
  for (const TrialResult& result : read_whole_lines(started_file_)) {
    if (result.index != next_) break;
    lines += line_of(result) + "\n";
    ++next_;
  }
  if (ftruncate(file_, 0) != 0) throw InputError(started_file_.string() + ": cannot be written");
  write(lines);
}

BlockWriter::~BlockWriter() { close(file_); }

void BlockWriter::add(const TrialResult& result) {
  write(line_of(result) + "\n");
  ++next_;
}

void BlockWriter::finish() {
  write_file(block_file_, lines_);
  fs::remove(started_file_);
}

void BlockWriter::write(const std::string& text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = ::write(file_, text.data() + written, text.size() - written);
    if (n < 0) throw InputError(started_file_.string() + ": cannot be written");
    written += static_cast<std::size_t>(n);
  }
  lines_ += text;
}

Summary merge(const Campaign& campaign) {
  Summary summary;
  summary.trials = campaign.manifest().total();
  // A block at a time: too long for the memory, maybe.
  WholeFile lines(campaign.trials_file());
  TrialWriter store(campaign.manifest(), campaign.results_file(), campaign.batch());
  for (const Block& block : campaign.blocks()) {
    const fs::path file = campaign.block_file(block);
    if (!fs::exists(file)) {
      summary.missing.push_back(block);
      continue;
    }
    const std::string text = read_file(file);
    std::vector<TrialResult> results;
    try {
      results = read_block(file, text);
      count(results, block, summary);
    } catch (const InputError& e) {
      throw InputError(file.string() + ": " + e.what() + "; delete it, and the trials run again");
    }
    store.add(results);
    lines.write(text);
  }
  store.finish();
  lines.finish();
  write_summary(campaign, summary);
  return summary;
}

void note_cost(const Campaign& campaign, const RunnerCost& cost, int jobs) {
  const nlohmann::ordered_json line = {{"machine", host_name()}, {"jobs", jobs},
                                       {"trials", cost.trials},  {"wall_s", cost.wall_s},
                                       {"user_s", cost.user_s},  {"system_s", cost.system_s}};
  const std::string text = json_text(line) + "\n";
  // In one write: the jobs of a cluster may all have come to their end now.
  const int out = open((campaign.directory() / "cost.jsonl").c_str(),
                       O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (out < 0) return;
  [[maybe_unused]] const ssize_t n = write(out, text.data(), text.size());
  close(out);
}

CampaignCost campaign_cost(const std::filesystem::path& directory) {
  std::ifstream lines(directory / "cost.jsonl");
  CampaignCost all;
  for (std::string line; std::getline(lines, line);) {
    const auto cost = nlohmann::json::parse(line, nullptr, false);
    if (!cost.is_object()) continue;
    const double trials = cost.value("trials", 0.0);
    all.trials += trials;
    all.processor_s += cost.value("user_s", 0.0) + cost.value("system_s", 0.0);
    const double rate = trials / std::max(cost.value("wall_s", 0.0), 1e-3);
    if (rate > all.fastest) all.jobs = cost.value("jobs", 1);
    all.fastest = std::max(all.fastest, rate);
  }
  return all;
}

std::string text_of(const RunnerCost& cost) {
  const auto trials = static_cast<double>(cost.trials);
  return std::to_string(cost.trials) + " trials in " + shown(cost.wall_s) +
         " s: " + shown(trials / cost.wall_s) + " a second; " +
         shown(1e3 * (cost.user_s + cost.system_s) / trials) + " ms of processor time a trial";
}

}  // namespace berth::campaigns
