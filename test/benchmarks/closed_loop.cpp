// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/closed_loop.h"

#include <utility>

#include "lcmtypes/conversions.h"
#include "test/estimator/beam/packets.h"

namespace berth::benchmark {
namespace {

constexpr std::int64_t session = 1;

estimator::EstimatorSetup setup_of(const estimator::EstimatorOptions& options,
                                   std::shared_ptr<const estimator::TargetModel> model,
                                   const BeamModel& noise) {
  estimator::EstimatorSetup setup;
  setup.options = options;
  setup.lidar.model = "benchmark";
  setup.lidar.field_of_view_width = setup.lidar.field_of_view_height = radians(40);
  setup.lidar.rate_hz = 2000;
  setup.lidar.minimum_step_rad = 20e-6;
  setup.lidar.beams_max = 1000000;
  setup.lidar.beam = noise;
  setup.target = model->target.name;
  setup.session = session;
  setup.find_model = [model](const std::string&) { return model; };
  setup.stopwatch = [] { return std::int64_t{0}; };
  return setup;
}

}  // namespace

ScanSource source_of(const World& world, const Pose& start, const Velocity& velocity,
                     Random random) {
  return [&world, start, velocity, random](const std::vector<Window>& windows,
                                           std::int64_t utime) mutable {
    const double elapsed = 1e-6 * static_cast<double>(utime - World::first_utime);
    return world.sweep(windows, moved(start, velocity, elapsed), velocity, utime, random);
  };
}

ClosedLoop::ClosedLoop(const estimator::EstimatorOptions& options,
                       std::shared_ptr<const estimator::TargetModel> model, const BeamModel& noise,
                       ScanSource source, const Pose& start, const Velocity& velocity)
    : source_(std::move(source)),
      start_(start),
      velocity_(velocity),
      latency_s_(options.request_latency_s),
      estimator_(setup_of(options, std::move(model), noise), *this) {}

Pose ClosedLoop::truth_at(std::int64_t utime) const {
  return moved(start_, velocity_, 1e-6 * static_cast<double>(utime - World::first_utime));
}

void ClosedLoop::track_from(const Pose& initial) {
  estimator_command_t command{};
  command.utime = utime_;
  command.seq = 1;
  command.session = session;
  command.commander = "benchmark";
  command.command = estimator_command_t::TRACK;
  command.first_scan_id = 1;
  command.has_initial_pose = 1;
  set_pose(initial, command.initial_position_m, command.initial_q_wxyz);
  estimator_.receive(command);
}

bool ClosedLoop::scan() {
  if (request_.scan_id == answered_ || request_.windows.empty()) return false;
  const scan_request_t request = request_;
  answered_ = request.scan_id;
  const Scan scan = source_(windows_of(request.windows), utime_);
  if (!scan.beams.empty()) utime_ = scan.beams.back().utime;
  for (const ScanPacket& packet :
       estimator::packets_of(scan.beams, request.scan_id, request.session))
    estimator_.receive(packet);
  utime_ += static_cast<std::int64_t>(1e6 * latency_s_);
  return true;
}

void ClosedLoop::run(double seconds) {
  const std::int64_t end = utime_ + static_cast<std::int64_t>(1e6 * seconds);
  while (utime_ < end && scan()) {
  }
}

void ClosedLoop::run_scans(int count) {
  for (int i = 0; i < count && scan(); ++i) {
  }
}

void ClosedLoop::estimate(const pose_estimate_t& message) {
  LoopEstimate e;
  e.scan_id = message.scan_id;
  e.time = 1e-6 * static_cast<double>(message.utime - World::first_utime);
  e.ok = message.status == pose_estimate_t::OK;
  e.pose = pose_of(message);
  e.truth = truth_at(message.utime);
  e.covariance = covariance_of(message.covariance);
  e.returns = message.returns_received;
  const std::int64_t last = message.utime_last_return;
  e.present = moved(e.pose, velocity_of(message), 1e-6 * static_cast<double>(last - message.utime));
  e.present_truth = truth_at(last);
  estimates_.push_back(e);
}

}  // namespace berth::benchmark
