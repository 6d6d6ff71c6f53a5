// SPDX-License-Identifier: BSD-3-Clause
#include "app/campaigns/cost.h"

#include <fcntl.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "common/core/text.h"

namespace berth::campaigns {

void note_cost(const Campaign& campaign, const RunnerCost& cost, int jobs) {
  char machine[256] = "";
  gethostname(machine, sizeof machine - 1);
  const nlohmann::ordered_json line = {{"machine", machine},    {"jobs", jobs},
                                       {"trials", cost.trials}, {"wall_s", cost.wall_s},
                                       {"user_s", cost.user_s}, {"system_s", cost.system_s}};
  const std::string text = line.dump() + "\n";
  // In one write: the jobs of a cluster may all have come to their end now.
  const int out = open((campaign.directory() / "cost.jsonl").c_str(),
                       O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (out < 0) return;
  [[maybe_unused]] const ssize_t n = write(out, text.data(), text.size());
  close(out);
}

std::string text_of(const RunnerCost& cost) {
  const auto trials = static_cast<double>(cost.trials);
  return std::to_string(cost.trials) + " trials in " + shown(cost.wall_s) +
         " s: " + shown(trials / cost.wall_s) + " a second; " +
         shown(1e3 * (cost.user_s + cost.system_s) / trials) + " ms of processor time a trial";
}

}  // namespace berth::campaigns
