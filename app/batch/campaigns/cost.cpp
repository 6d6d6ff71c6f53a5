// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/cost.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/host_name.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::campaigns {

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
