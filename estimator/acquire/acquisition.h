// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/beam/scan.h"

namespace berth::estimator {

/// A pose that may explain a scan.
struct Hypothesis {
  Pose pose;  ///< T_sensor_model
  double log_likelihood = 0;
  double probability = 0;  ///< that the target is there
  int equal_poses = 1;     ///< that a symmetry of the target makes one and the same
};

struct AcquisitionResult {
  enum class Status { found, ambiguous, not_found, refused };
  Status status = Status::not_found;
  std::string reason;  ///< empty when found
  std::vector<Hypothesis>
      hypotheses;          ///< best first, distinct; of found ones probabilities sum to 1
  double noise_scale = 1;  ///< on the beam model's sigmas, as the returns show it
};

/// Finds the target's pose in one scan without any prior. const and deterministic; the model, beam
/// model and options that it was made from must outlive it.
class Acquisition {
 public:
  virtual ~Acquisition() = default;

  /// As configuration files and estimates name the method.
  virtual std::string name() const = 0;
  /// Empty, or why this model cannot be acquired by this method.
  virtual std::string refusal() const { return ""; }
  /// hints: what an earlier scan left open, if anything: poses to look at first, with the
  /// log-likelihoods that they had then.
  virtual AcquisitionResult acquire(const CleanScan& scan,
                                    const std::vector<Hypothesis>& hints) const = 0;
  AcquisitionResult acquire(const CleanScan& scan) const { return acquire(scan, {}); }
};

}  // namespace berth::estimator
