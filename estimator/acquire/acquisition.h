// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/beam/scan.h"

namespace berth::estimator {

/// A candidate pose of the target.
struct Hypothesis {
  Pose pose;  ///< T_sensor_model
  double log_likelihood = 0;
  double probability = 0;  ///< posterior probability of this pose
  int equal_poses = 1;     ///< number of poses equal under the target's exact symmetries
};

/// The result of an acquisition.
struct AcquisitionResult {
  enum class Status { found, ambiguous, not_found, refused };
  Status status = Status::not_found;
  std::string reason;  ///< empty when found
  std::vector<Hypothesis>
      hypotheses;  ///< by descending probability, distinct; probabilities of found ones sum to 1
  double noise_scale = 1;  ///< estimated factor on the beam model's sigmas
};

/// Pose estimation from one scan without a prior. const and deterministic; the model, beam model
/// and options must outlive it.
class Acquisition {
 public:
  virtual ~Acquisition() = default;

  /// Its name in configuration files and estimates.
  virtual std::string name() const = 0;
  /// Empty, or why the method cannot acquire this model.
  virtual std::string refusal() const { return ""; }
  /// hints: undecided hypotheses of an earlier scan, with their log-likelihoods; they are
  /// evaluated, too.
  virtual AcquisitionResult acquire(const PreprocessedScan& scan,
                                    const std::vector<Hypothesis>& hints) const = 0;
  AcquisitionResult acquire(const PreprocessedScan& scan) const { return acquire(scan, {}); }
};

}  // namespace berth::estimator
