// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/check/rehearsal.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/bus/loop.h"
#include "common/core/text.h"
#include "procedures/engine/motion_steps.h"

namespace berth::procedures {

Rig::Rig(const RunSetup& run, testbed::CalibratedCell calibrated)
    : setup(run),
      calibration(std::move(calibrated.calibration)),
      cell(std::move(calibrated.cell)),
      settings(testbed::load_settings(run.config / "testbed.yaml", cell)),
      clearance(cell, settings.clearance),
      path_check(cell, settings.path, clearance),
      planner(cell, path_check, clearance),
      surface(cell.target.mesh),
      commands(cell, settings, planner, surface),
      estimator(estimator::load_estimator_options(run.config / "estimator.yaml")),
      lidar(load_lidar_profile(run, estimator.lidar)) {}

double Rig::scan_period(int returns) const {
  const int beams = returns > 0 ? returns : estimator.returns_per_scan;
  return beams / lidar.rate_hz + estimator.request_latency_s;
}

double Rig::acquisition_time() const {
  return (estimator.acquire_beams + estimator.zoom_beams) / lidar.rate_hz +
         2 * estimator.request_latency_s;
}

namespace {

using testbed::ArmPair;
using testbed::both_arms;

/// Lamps, orders and their answers: about as long as the simulated cell's take.
constexpr double answer_time = 1.0;
/// Farther bodies are not looked for, m.
constexpr double nothing_near = 10.0;
/// rad, range above which a joint counts as unlimited.
constexpr double endless = radians(3600.0);
/// Number of places of a motion at which clearance is evaluated for the list.
constexpr int looks_on_a_path = 40;

/// Duration of a step that does not move the arms, and the assumptions made.
struct Course {
  double duration = 0;
  bool guessed = false;
  std::string remark;
};

struct CourseOf {
  const Rig& rig;

  Course operator()(const Lights&) const { return {answer_time, true, ""}; }
  Course operator()(const StopTracking&) const { return {answer_time, true, ""}; }
  Course operator()(const Annotate&) const { return {}; }
  Course operator()(const Wait& wait) const { return {wait.duration, false, ""}; }
  Course operator()(const Hold& hold) const { return {hold.duration, false, ""}; }
  Course operator()(const Guided& guided) const {
    return {guided.duration, true, "where '" + guided.by + "' will steer is not known"};
  }
  Course operator()(const Acquire&) const {
    return {rig.acquisition_time(), true, "found at the first look"};
  }
  Course operator()(const Track& track) const {
    return {track.settle * rig.scan_period(track.returns), true, ""};
  }
  Course operator()(const Dwell& dwell) const {
    return {dwell.settle + dwell.estimates * rig.scan_period(0), true, ""};
  }
  Course operator()(const WaitUntil& wait) const {
    return {wait.condition.duration, true, "so at once"};
  }
  Course operator()(const Prompt&) const { return {answer_time, true, "answered at once"}; }
  Course operator()(const Inject&) const { return {answer_time, true, ""}; }
  Course operator()(const ClearInjections&) const { return {answer_time, true, ""}; }
  Course operator()(const Scan& scan) const {
    return {scan.window.count / rig.lidar.rate_hz + answer_time, true, ""};
  }
  template <class Motion>
  Course operator()(const Motion&) const {
    return {};
  }
};

}  // namespace

Rehearsal::Rehearsal(Rig& rig, const ArmPair& start)
    : rig_(rig), guidance_(rig.surface, rig.settings.guidance), history_(rig.cell) {
  now_.joints = start;
  now_.pose = rig.cell.relative_pose(start.replica, start.sensor);
  moments_.push_back(now_);
}

const StepForecast& Rehearsal::perform(const Step& step) {
  StepForecast forecast;
  forecast.name = step.name;
  forecast.phase = step.phase;
  forecast.line = step.line;
  forecast.start = now_.time;
  forecast.first_moment = moments_.size() - 1;
  if (std::holds_alternative<Acquire>(step.verb)) now_.tracked = false;
  steered_ = steered_ || std::holds_alternative<Guided>(step.verb);
  forecast.steered = steered_;
  if (const auto command = motion_command(step.verb, now_.pose)) {
    move(*command, forecast);
    steered_ = steered_ && testbed::is_closed_loop(*command);
  }
  const Course course = std::visit(CourseOf{rig_}, step.verb);
  stay(std::max(0.0, course.duration - (now_.time - forecast.start)));
  forecast.guessed = forecast.guessed || course.guessed;
  if (!course.remark.empty()) forecast.remark = course.remark;
  if (!step.gates.empty()) forecast.remark = "if " + step.gates.back().condition.text;
  if (std::holds_alternative<Acquire>(step.verb)) now_.tracked = true;
  if (const auto* track = std::get_if<Track>(&step.verb)) {
    now_.tracked = true;
    now_.returns = track->returns;
  }
  if (std::holds_alternative<StopTracking>(step.verb)) now_.tracked = false;
  // the estimate with which an acquisition ends
  moments_.back().tracked = moments_.back().tracked || now_.tracked;
  forecast.duration = now_.time - forecast.start;
  forecast.last_moment = moments_.size() - 1;
  steps_.push_back(std::move(forecast));
  return steps_.back();
}

void Rehearsal::stay(double duration) {
  const double start = now_.time;
  const int count = static_cast<int>(std::ceil(duration / spacing));
  for (int i = 1; i <= count; ++i) {
    now_.time = start + duration * i / count;
    moments_.push_back(now_);
  }
}

std::variant<Rehearsal::Motion, std::string> Rehearsal::motion_of(
    const testbed_command2_t& command) {
  if (command.command == testbed_command2_t::RETREAT) {
    auto way_back = rig_.commands.way_back(command, history_, rig_.path_check, now_.joints);
    history_.clear();
    return way_back;
  }
  const std::int64_t time = utime_from_seconds(now_.time);
  // The estimate is taken as exact: guidance flies the predicted path.
  guidance_.note_commanded(time, now_.pose);
  guidance_.on_estimate({time, now_.pose, true, "", true});
  auto result = rig_.commands.plan(command, now_.joints, time, guidance_);
  if (auto* refusal = std::get_if<std::string>(&result)) return std::move(*refusal);
  history_.begin(now_.joints);
  return std::get<testbed::CommandPlanner::Plan>(std::move(result)).arms.motion;
}

void Rehearsal::move(const testbed_command2_t& command, StepForecast& forecast) {
  forecast.from_afar = lost_;
  if (command.dock != 0) forecast.docking_port = command.port;
  const auto result = motion_of(command);
  if (const auto* refusal = std::get_if<std::string>(&result)) {
    forecast.refusal = *refusal;
    lost_ = ever_lost_ = true;
    return;
  }
  if (!testbed::is_closed_loop(command)) lost_ = false;  // it ends at its commanded pose
  const auto& motion = *std::get<Motion>(result);
  forecast.guessed = testbed::is_closed_loop(command);
  if (forecast.guessed) forecast.remark = "the estimate is as commanded all the way";
  forecast.moves = true;
  forecast.clearance = nothing_near;
  forecast.joint_margin = std::numeric_limits<double>::infinity();
  look_around(now_.joints, forecast);
  const double start = now_.time;
  const int count = std::max(1, static_cast<int>(std::ceil(motion.duration() / spacing)));
  const int between_looks = std::max(1, count / looks_on_a_path);
  for (int i = 1; i <= count; ++i) {
    const double t = motion.duration() * i / count;
    const auto joints = motion.at(t, now_.joints, nullptr);
    if (!joints) break;  // the check has found a solution
    now_.time = start + t;
    now_.joints = *joints;
    if (command.command != testbed_command2_t::RETREAT) history_.add(now_.joints);
    now_.pose = rig_.cell.relative_pose(joints->replica, joints->sensor);
    if (motion.duration() > 0) moments_.push_back(now_);
    if (i % between_looks == 0 || i == count) look_around(now_.joints, forecast);
  }
}

void Rehearsal::look_around(const ArmPair& joints, StepForecast& forecast) {
  const auto near = rig_.clearance.nearest(joints, forecast.clearance);
  if (!near.a.empty()) {
    forecast.clearance = near.distance;
    forecast.near_a = near.a;
    forecast.near_b = near.b;
  }
  for (const ArmRole role : both_arms) {
    const ArmKinematics& arm = *rig_.cell.arm(role).kinematics;
    for (std::size_t i = 0; i < 6; ++i) {
      const JointLimit& limit = arm.limits()[i];
      if (arm.is_linear(static_cast<int>(i)) || limit.high - limit.low > endless) continue;
      const double q = joints.of(role)[i];
      const double margin = std::min(q - limit.low, limit.high - q);
      if (margin >= forecast.joint_margin) continue;
      forecast.joint_margin = margin;
      forecast.joint = std::string(name_of(role)) + " J" + std::to_string(i + 1);
    }
  }
}

}  // namespace berth::procedures
