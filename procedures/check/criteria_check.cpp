// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <berth/testbed_state_t.hpp>
#include <cmath>

#include "common/core/file.h"
#include "common/core/text.h"
#include "evaluation/measure/measurement.h"
#include "evaluation/run/run_record.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/conversions.h"
#include "procedures/check/check.h"

namespace berth::procedures {
namespace {

/// Of the first step; any time but 0, which stands for "never".
constexpr Utime start = second;

Utime utime_of(double t) { return start + utime_from_seconds(t); }

/// One arm on its way between two moments. The encoders add little to the calibration's
/// uncertainty.
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

  testbed::TruthCovariance truth_covariance(rig.cell, rig.calibration);
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
        truth_covariance.at(moment_of(before.joints.replica, moment.joints.replica, dt),
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

namespace {

std::string in_unit(double value, const std::string& unit) {
  return fixed(value, 2) + (unit.empty() ? "" : " " + unit);
}

/// The limits as text.
std::string limits_of(const criterion_result_t& result) {
  std::string text;
  if (std::isfinite(result.lower_limit))
    text = "at least " + in_unit(result.lower_limit, result.unit);
  if (std::isfinite(result.upper_limit)) {
    text += (text.empty() ? "" : " and ") + std::string("at most ") +
            in_unit(result.upper_limit, result.unit);
  }
  return text;
}

class CriteriaCheck {
 public:
  CriteriaCheck(const Procedure& procedure, const Rig& rig, const Rehearsal& rehearsal)
      : procedure_(procedure),
        rig_(rig),
        rehearsal_(rehearsal),
        record_(forecast_record(rig, rehearsal, true)),
        truth_alone_(forecast_record(rig, rehearsal, false)),
        measurer_(record_, evaluation::nearest_point_on(rig.cell.target)),
        truth_measurer_(truth_alone_, evaluation::nearest_point_on(rig.cell.target)) {}

  std::vector<Finding> run() {
    for (const evaluation::Criterion& criterion : procedure_.criteria) look_at(criterion);
    return std::move(findings_);
  }

 private:
  void add(const evaluation::Criterion& criterion, Severity severity, const std::string& found,
           const std::string& expected = "") {
    findings_.push_back({severity, procedure_.file, criterion.line,
                         "criterion '" + criterion.name + "'", found, expected, -1});
  }

  bool anything_tracked(const std::string& phase_name) const {
    const auto phase = record_.phase(phase_name);
    return phase && std::any_of(record_.estimates().begin(), record_.estimates().end(),
                                [&](const auto& e) { return phase->contains(e.utime); });
  }

  template <class Applies>
  bool none_of_phase(const std::string& phase, Applies applies) const {
    const auto& steps = rehearsal_.steps();
    return std::none_of(steps.begin(), steps.end(), [&](const StepForecast& step) {
      return applies(step) && (phase == evaluation::whole_run || step.phase == phase);
    });
  }

  /// Whether the durations of all steps of the phase follow from the procedure.
  bool timed(const std::string& phase) const {
    return none_of_phase(phase, [](const StepForecast& step) { return step.guessed; });
  }

  /// Whether the motion of the arms in it follows from the procedure.
  bool foreseen(const std::string& phase) const {
    return none_of_phase(phase, [](const StepForecast& step) { return step.steered; });
  }

  bool anything_injected() const {
    return std::any_of(procedure_.steps.begin(), procedure_.steps.end(),
                       [](const Step& step) { return std::holds_alternative<Inject>(step.verb); });
  }

  void look_at(const evaluation::Criterion& criterion) {
    if (criterion.measurement->family == evaluation::safety_family) {
      // Reactions to injected faults are not predicted.
      if (anything_injected()) return;
      return add(criterion, Severity::error, "nothing is injected", "an 'inject' before it");
    }
    if (criterion.measurement->of_returns && anything_tracked(criterion.phase)) return;
    const criterion_result_t result = evaluation::judge(criterion, measurer_);
    const criterion_result_t truth = evaluation::judge(criterion, truth_measurer_);
    const bool by_truth_alone = result.value == truth.value;
    const std::string phase = "phase '" + criterion.phase + "'";
    if (std::isnan(result.value)) return cannot_be_measured(criterion, result);
    if ((!by_truth_alone || result.samples == 0) && !anything_tracked(criterion.phase)) {
      return add(criterion, Severity::error, "nothing is tracked in " + phase,
                 "an 'acquire' before it, or another phase");
    }
    if (result.samples < criterion.samples) {
      return add(
          criterion, Severity::warning,
          "about " + std::to_string(result.samples) + " samples are to be expected in " + phase,
          std::to_string(criterion.samples) + ", or a longer phase");
    }
    if (result.result == criterion_result_t::INCONCLUSIVE) {
      return add(criterion, Severity::warning,
                 "truth itself is uncertain by " + in_unit(2 * result.uncertainty, result.unit) +
                     " (2 sigma): without any error this would be inconclusive",
                 limits_of(result));
    }
    // Nor is the end of a phase after an injected fault.
    const bool certain = !anything_injected() && foreseen(criterion.phase) &&
                         (criterion.measurement->series || timed(criterion.phase));
    if (result.result == criterion_result_t::FAILED && by_truth_alone && certain &&
        !rehearsal_.lost_its_way()) {
      add(criterion, Severity::error,
          "if all goes as planned, " + result.measurement + " in " + phase + " is " +
              in_unit(result.value, result.unit) +
              (criterion.nominal != 0 ? " off its nominal value" : ""),
          limits_of(result));
    }
  }

  void cannot_be_measured(const evaluation::Criterion& criterion,
                          const criterion_result_t& result) {
    const std::string& name = criterion.measurement->name;
    if (name.rfind("docking", 0) == 0 && rig_.cell.target.ports.empty()) {
      return add(criterion, Severity::error,
                 "target '" + rig_.cell.target.name + "' has no docking port",
                 "another target or measurement");
    }
    if (!anything_tracked(criterion.phase)) {
      return add(
          criterion, Severity::error,
          name + " cannot be measured: nothing is tracked in phase '" + criterion.phase + "'",
          "an 'acquire' before it, or another phase");
    }
    add(criterion, Severity::error, name + " cannot be measured: " + result.reason);
  }

  const Procedure& procedure_;
  const Rig& rig_;
  const Rehearsal& rehearsal_;
  evaluation::RunRecord record_;
  evaluation::RunRecord truth_alone_;
  evaluation::Measurer measurer_;
  evaluation::Measurer truth_measurer_;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> check_criteria(const Procedure& procedure, const Rig& rig,
                                    const Rehearsal& rehearsal) {
  return CriteriaCheck(procedure, rig, rehearsal).run();
}

}  // namespace berth::procedures
