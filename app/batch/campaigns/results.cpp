// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/results.h"

#include <nlohmann/json.hpp>

#include "common/core/error.h"
#include "common/core/file.h"
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

std::vector<TrialResult> read_results(const fs::path& file) {
  std::vector<TrialResult> results;
  for_each_line(read_file(file), [&](const std::string& line) {
    results.push_back(
        result_of_line(line, file.string() + ":" + std::to_string(results.size() + 1)));
  });
  return results;
}

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

}  // namespace berth::campaigns
