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
  config.optional("cpus", options.cpus, at_least(1));
  config.optional("at_a_time", options.at_a_time);
  config.optional("task", Dimension::time, options.task_s, above(0));
  config.optional("trial", Dimension::time, options.trial_s);
  config.optional("task_trials", options.task_trials, at_least(0));
  config.optional("arguments", options.arguments);
  config.optional("before", options.before);
  config.finish();
  return options;
}

}  // namespace berth::campaigns
