// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/slurm_options.h"

#include "common/core/config.h"

namespace berth::campaigns {

SlurmOptions load_slurm_options(const std::filesystem::path& file) {
  SlurmOptions options;
  Config config = Config::load(file);
  config.optional("partition", options.partition);
  config.optional("time", Dimension::time, options.time_limit_s);
  config.optional("memory", options.memory);
  config.optional("cpus", options.cpus);
  config.optional("at_a_time", options.at_a_time);
  config.optional("task", Dimension::time, options.task_s);
  config.optional("trial", Dimension::time, options.trial_s);
  config.optional("task_trials", options.task_trials);
  if (config.has("arguments")) options.arguments = config.texts("arguments");
  config.optional("before", options.before);
  config.finish();
  if (options.cpus < 1) throw config.error("cpus", "expected at least 1");
  if (options.task_trials < 0) throw config.error("task_trials", "expected a number of trials");
  if (!(options.task_s > 0)) throw config.error("task", "expected a time above zero");
  return options;
}

}  // namespace berth::campaigns
