// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <filesystem>

#include "app/batch/campaigns/campaign.h"
#include "app/batch/campaigns/sphere_map.h"
#include "app/batch/campaigns/trial_store.h"

namespace berth::campaigns {

/// A manifest of single acquisitions over returns and noise, at any attitude and a drawn range.
inline Manifest made_manifest(std::int64_t trials) {
  return parse_manifest(
      "name: made up\n"
      "experiment: acquisition\n"
      "target: radarsat2\n"
      "seed: 3\n"
      "trials: " +
          std::to_string(trials) +
          "\n"
          "grid:\n"
          "  returns: [50, 100, 500, 1000, 3000]\n"
          "  range_noise: [10 mm, 20 mm]\n"
          "draw:\n"
          "  attitude: any attitude\n"
          "  range: {uniform: [4 m, 6 m]}\n"
          "measurements: [position_error, roll_error, pitch_error, yaw_error]\n",
      "made_up.yaml");
}

/// Made up: the more returns the better; seen along x nothing is found, whatever the returns.
inline TrialResult made_result(const Manifest& manifest, std::int64_t index) {
  const Trial trial = trial_of(manifest, index);
  TrialResult result = result_for(trial);
  Random random(trial.seed, "made up");
  const double returns = quantity_of(trial.parameters[0].second)->value;
  const double noise = quantity_of(trial.parameters[1].second)->value;
  const double edge_on = std::abs(direction_in_model(viewing_direction(*trial.attitude)).x());
  const double spread = noise / std::sqrt(returns);
  result.outcome = Outcome::pass;
  if (edge_on > 0.97) {
    result.outcome = Outcome::fail;
    result.failure = "lost";
  } else if (random.uniform() < 3 / returns) {
    result.outcome = Outcome::fail;
    result.failure = "wrong";
  }
  const double wrong = result.failure == "wrong" ? 100 : 1;
  if (result.failure != "lost") {
    result.measurements["position_error"] = wrong * spread * random.normal_vector(1).norm();
    for (const char* name : {"roll_error", "pitch_error", "yaw_error"}) {
      result.measurements[name] = wrong * std::abs(random.normal(0.3 * spread));
    }
  }
  return result;
}

inline void make_trials(const Manifest& manifest, const std::filesystem::path& directory) {
  std::filesystem::create_directories(directory);
  TrialWriter out(manifest, directory / Campaign::results_name, {});
  std::vector<TrialResult> trials;
  for (std::int64_t i = 0; i < manifest.total(); ++i) trials.push_back(made_result(manifest, i));
  out.add(trials);
  out.finish();
}

}  // namespace berth::campaigns
