// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "estimator/single_scan.h"
#include "test/estimator/scan_maker.h"

namespace berth::estimator {

/// One scan of a target as a user's file would hold it, the shipped configuration, and the truth.
struct SingleScanFixture {
  std::shared_ptr<const TargetModel> model = replica_model();
  EstimatorOptions options = load_estimator_options("config/estimator.yaml");
  double scale = 1;  ///< of the target, over its model
  BeamModel beam_model = without_range_limits({});
  Pose truth = pose_from_xyzwpr({100, -230, 6000, 25, 20, -30});

  SingleScanResult estimate(const std::vector<RawBeam>& beams,
                            const std::optional<Pose>& initial = {}) const {
    return SingleScan(*model, scale, options, beam_model)
        .estimate(preprocess(beams, {}, beam_model), initial);
  }

  /// Beams over all of the model and a margin about it, seen from the truth.
  std::vector<RawBeam> scan(int count, std::uint64_t seed = 1) const {
    ScanMaker lidar(scaled_to_length(model->target.mesh, scale * model->target.length), seed);
    lidar.beam = beam_model;
    lidar.pose = truth;
    const Pose unscaled{truth.position / scale, truth.rotation};
    return lidar.sweep(around(*model, unscaled, count));
  }

  /// How far the model's surface in this pose is from its surface in the true one at most, of its
  /// length: small for a right pose, whatever symmetry the target has.
  double max_residual(const Pose& pose) const {
    Pose to_truth = truth.inverse() * pose;
    to_truth.position /= scale;
    double worst = 0;
    for (const SurfaceSample& sample : model->surface.samples) {
      const Vector3d p = to_truth * sample.position.cast<double>();
      worst = std::max(worst, (model->caster.nearest(p) - p).norm());
    }
    return worst / model->target.length;
  }
  bool is_right(const Pose& pose) const { return max_residual(pose) < 0.03; }
  /// Reports ok and is wrong.
  bool silently_wrong(const SingleScanResult& result) const {
    return result.status == SingleScanResult::Status::ok &&
           !is_right(result.candidates.front().pose);
  }
};

/// The returns alone, as formats without empty beams hold them.
inline std::vector<RawBeam> hits_of(const std::vector<RawBeam>& beams) {
  std::vector<RawBeam> hits;
  for (const RawBeam& beam : beams) {
    if (beam.status == BeamStatus::hit) hits.push_back(beam);
  }
  return hits;
}

/// Every return carried along by a motion, every miss turned with it.
inline std::vector<RawBeam> moved_beams(std::vector<RawBeam> beams, const Pose& motion) {
  for (RawBeam& beam : beams) {
    const Vector3d direction = beam_direction(beam.azimuth, beam.elevation);
    const bool hit = beam.status == BeamStatus::hit;
    const Vector3d p = hit ? motion * (beam.range * direction) : motion.rotation * direction;
    beam_angles(p, beam.azimuth, beam.elevation);
    if (hit) beam.range = p.norm();
  }
  return beams;
}

}  // namespace berth::estimator
