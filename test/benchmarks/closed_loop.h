// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "estimator/node/estimator.h"
#include "evaluation/trials/world.h"
#include "test/benchmarks/settings.h"

namespace berth::benchmark {

/// An estimate and where the target truly was then.
struct LoopEstimate {
  std::int64_t scan_id = 0;
  double time = 0;  ///< s since the start, at which the pose holds
  bool ok = false;
  Pose pose;  ///< filtered
  Pose truth;
  Matrix6d covariance = Matrix6d::Identity();
  int returns = 0;
  // The same brought forward to the scan's last return, along the velocity that is estimated: what
  // is known of the present when the scan ends.
  Pose present;
  Pose present_truth;

  Vector6d error() const { return difference(truth, pose); }
  Vector6d present_error() const { return difference(present_truth, present); }
};

/// What the LIDAR returns from windows, the first beam at a time.
using ScanSource = std::function<Scan(const std::vector<Window>& windows, std::int64_t utime)>;

/// From a world whose target is at start (T_sensor_model) at time 0 and moves evenly. The world
/// must outlive it.
ScanSource source_of(const World& world, const Pose& start, const Velocity& velocity,
                     Random random);

/// The whole estimator, as the rig runs it, in a closed loop with a world: it requests scans, gets
/// packets of 50 beams of a target that moves meanwhile, and estimates.
class ClosedLoop final : public estimator::EstimatorOutput {
 public:
  /// start: T_sensor_model at time 0. velocity: of the model's origin, sensor frame. Both are for
  /// the truth of estimates: the source shows the target.
  ClosedLoop(const estimator::EstimatorOptions& options,
             std::shared_ptr<const estimator::TargetModel> model, const BeamModel& noise,
             ScanSource source, const Pose& start, const Velocity& velocity);

  void track_from(const Pose& initial);
  /// Answers scans until so much time has passed, or nothing is requested.
  void run(double seconds);
  /// Answers so many scans, or until nothing is requested.
  void run_scans(int count);
  const std::vector<LoopEstimate>& estimates() const { return estimates_; }

  void request(const scan_request_t& message) override { request_ = message; }
  void estimate(const pose_estimate_t& message) override;
  void state(const estimator_state_t&) override {}
  void diagnostics(const estimator_diagnostics_t&) override {}
  void note(std::int8_t, const std::string&, const std::string&) override {}

 private:
  Pose truth_at(std::int64_t utime) const;
  bool scan();

  ScanSource source_;
  Pose start_;
  Velocity velocity_;
  double latency_s_;
  std::int64_t utime_ = World::first_utime;
  scan_request_t request_{};
  std::int64_t answered_ = 0;
  std::vector<LoopEstimate> estimates_;
  estimator::Estimator estimator_;
};

}  // namespace berth::benchmark
