// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/campaigns/trial.h"

namespace berth::campaigns {

Trial trial_of(const Manifest& manifest, std::int64_t index) {
  Trial trial;
  trial.index = index;
  trial.point = index % manifest.points();
  // The name is left out of the stream, so that a copy of a manifest under another one is the same.
  Random random(manifest.seed, "trial " + std::to_string(index));
  trial.seed = random.bits() >> 11;
  const auto take = [&](const Parameter& parameter, std::size_t which, Assignments& into) {
    DrawnValue value = draw(parameter, which, random);
    into.emplace_back(parameter.name, std::move(value.text));
    if (value.attitude) trial.attitude = value.attitude;
  };
  const auto place = manifest.place_of(trial.point);
  for (std::size_t axis = 0; axis < place.size(); ++axis) {
    take(manifest.grid[axis], place[axis], trial.parameters);
  }
  for (const Parameter& parameter : manifest.drawn) take(parameter, 0, trial.parameters);
  for (const Parameter& parameter : manifest.fixed) take(parameter, 0, trial.fixed);
  return trial;
}

TrialResult result_for(const Trial& trial) {
  TrialResult result;
  result.index = trial.index;
  result.point = trial.point;
  result.seed = trial.seed;
  result.parameters = trial.parameters;
  result.attitude = trial.attitude;
  return result;
}

}  // namespace berth::campaigns
