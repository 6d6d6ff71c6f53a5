// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "app/batch/campaigns/trial.h"
#include "app/batch/result_store.h"

namespace berth::campaigns {

/// Writes a campaign's results.sqlite, whole or not at all. A trial is a run: its point of the grid
/// the case, a kept measurement a value; what is left are details, named as in trials.jsonl:
/// "trial", "point", "failure", "attitude_wxyz", "parameters.returns". Those with several numbers
/// have blanks between them.
class TrialWriter {
 public:
  /// @param batch its record; id and number are filled in here
  /// @throws InputError when the file cannot be written
  TrialWriter(const Manifest& manifest, const std::filesystem::path& file, BatchRecord batch);
  /// The next ones, in their order. @throws std::runtime_error when they cannot be written
  void add(const std::vector<TrialResult>& trials);
  void finish();

 private:
  const Manifest& manifest_;
  std::filesystem::path file_;
  std::filesystem::path unfinished_;
  std::optional<ResultStore> store_;
  BatchRecord batch_;
};

/// All trials of a results.sqlite, in their order, one at a time.
/// @throws InputError when it is missing, or one of another kind
void for_each_trial(const Manifest& manifest, const std::filesystem::path& file,
                    const std::function<void(const TrialResult&)>& each);

}  // namespace berth::campaigns
