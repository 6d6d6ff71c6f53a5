// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/check/recording.h"

#include <berth/testbed_state_t.hpp>

#include "common/core/file.h"
#include "lcmtypes/conversions.h"

namespace berth::procedures {
namespace {

/// Of the first step; any time but 0, which stands for "never".
constexpr Utime start = second;

Utime utime_of(double t) { return start + utime_from_seconds(t); }

/// One arm on its way between two moments. The encoders add little to what the calibration leaves
/// in doubt.
testbed::ArmMoment moment_of(const Joints& before, const Joints& joints, double dt) {
  testbed::ArmMoment moment;
  moment.joints = joints;
  for (std::size_t i = 0; i < 6 && dt > 0; ++i) moment.rate[i] = (joints[i] - before[i]) / dt;
  return moment;
}

pose_estimate_t right_estimate(const Moment& moment, const Velocity& velocity,
                               const Matrix6d& covariance) {
  pose_estimate_t estimate{};
  estimate.utime = utime_of(moment.time);
  estimate.status = pose_estimate_t::OK;
  set_pose(moment.pose, estimate);
  set_pose(moment.pose, estimate.measured_position_m, estimate.measured_q_wxyz);
  set_velocity(velocity, estimate);
  set_covariance(covariance, estimate.covariance);
  set_covariance(covariance, estimate.velocity_covariance);
  return estimate;
}

procedure_state_t state_of(const Rehearsal& rehearsal) {
  procedure_state_t state{};
  state.utime = utime_of(rehearsal.duration());
  state.state = procedure_state_t::FINISHED;
  state.utime_start = start;
  for (const StepForecast& forecast : rehearsal.steps()) {
    procedure_step_t step{};
    step.name = forecast.name;
    step.phase = forecast.phase;
    step.state = procedure_step_t::PASSED;
    step.attempts = 1;
    step.utime_start = utime_of(forecast.start);
    step.utime_end = utime_of(forecast.start + forecast.duration);
    state.steps.push_back(step);
  }
  state.step_count = static_cast<std::int32_t>(state.steps.size());
  return state;
}

}  // namespace

evaluation::RunRecord forecast_record(const Rig& rig, const Rehearsal& rehearsal,
                                      bool with_estimates) {
  evaluation::RunRecord record;
  run_info_t info{};
  info.target = rig.setup.target;
  info.target_length_m = rig.cell.target.length;
  info.target_hash = rig.cell.target.hash;
  info.layout = rig.setup.layout;
  attachment_t settings{};
  settings.name = "testbed.yaml";
  settings.content = read_file(rig.setup.config / settings.name);
  info.attachments = {settings};
  if (const Target& target = rig.cell.target; !target.is_bare()) {
    attachment_t description{};
    description.name = target_file;
    description.content = read_file(target.files.front());
    info.attachments.push_back(description);
  }
  info.attachment_count = static_cast<std::int32_t>(info.attachments.size());
  record.add(info);
  record.add(state_of(rehearsal));
  for (const StepForecast& forecast : rehearsal.steps()) {
    if (!forecast.docking_port) continue;
    testbed_command2_t command{};
    command.utime = utime_of(forecast.start);
    command.command = testbed_command2_t::APPROACH;
    command.dock = 1;
    command.port = *forecast.docking_port;
    record.add(command);
  }

  testbed::TruthCovariance doubt(rig.cell, rig.calibration);
  const auto& moments = rehearsal.moments();
  double next_estimate = 0;
  std::int64_t seq = 0;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const Moment& moment = moments[i];
    const Moment& before = moments[i > 0 ? i - 1 : 0];
    const double dt = moment.time - before.time;
    if (i > 0 && utime_of(moment.time) == utime_of(before.time)) continue;
    const Velocity velocity = dt > 0 ? velocity_between(before.pose, moment.pose, dt) : Velocity{};
    const Matrix6d covariance =
        doubt.at(moment_of(before.joints.replica, moment.joints.replica, dt),
                 moment_of(before.joints.sensor, moment.joints.sensor, dt));
    ground_truth_t truth{};
    truth.utime = utime_of(moment.time);
    truth.seq = static_cast<std::int64_t>(i);
    set_pose(moment.pose, truth);
    set_velocity(velocity, truth);
    set_covariance(covariance, truth.covariance);
    record.add(truth);
    testbed_state_t testbed{};
    testbed.utime = truth.utime - rig.settings.dead_time;
    testbed.seq = truth.seq;
    testbed.state = testbed_state_t::MOVING;
    set_pose(moment.pose, testbed.commanded_position_m, testbed.commanded_q_wxyz);
    record.add(testbed);
    if (!with_estimates || !moment.tracked || moment.time < next_estimate) continue;
    next_estimate = moment.time + rig.scan_period(moment.returns);
    pose_estimate_t estimate = right_estimate(moment, velocity, covariance);
    estimate.seq = ++seq;
    record.add(estimate);
    estimator_diagnostics_t diagnostics{};
    diagnostics.utime = estimate.utime;
    diagnostics.seq = estimate.seq;
    diagnostics.names = {"latency_us"};
    diagnostics.values = {0};
    diagnostics.value_count = 1;
    record.add(diagnostics);
  }
  return record;
}

}  // namespace berth::procedures
