// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace berth::campaigns {

/// What a cluster wants to be told. It is no part of the campaign: no result depends on it.
struct SlurmOptions {
  std::string partition;               ///< empty: the cluster's default
  double time_limit_s = 0;             ///< of one task; 0: the partition's
  std::string memory;                  ///< of one task, as sbatch takes it: "2G"
  int cpus = 1;                        ///< of one task: as many workers run in it
  int at_a_time = 0;                   ///< tasks; 0: as many as the cluster has room for
  double task_s = 120;                 ///< how long a task should take, at least
  double trial_s = 0;                  ///< processor time of a trial; 0: measured
  std::int64_t task_trials = 0;        ///< instead of the two above; 0: they decide
  std::vector<std::string> arguments;  ///< other ones of sbatch
  std::string before;                  ///< shell lines that a task runs first ("module load ...")
};

/// Reads a file such as
///
///     partition: main
///     time: 30 min
///     memory: 2G
///     arguments: [--account=lab, --nice=100]
///
/// @throws InputError "file:line: key ...".
SlurmOptions load_slurm_options(const std::filesystem::path& file);

}  // namespace berth::campaigns
