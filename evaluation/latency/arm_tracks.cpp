// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/latency/arm_tracks.h"

#include <algorithm>
#include <cmath>

namespace berth::evaluation {
namespace {

constexpr Utime max_gap = 100 * millisecond;  // between set-points of one motion
constexpr Utime rate_window = 50 * millisecond;
constexpr std::size_t max_samples = 2000;
constexpr double zero_sigma = 0.02;  // rad or m: of a reported joint against the commanded
constexpr double min_sigma = 1e-7;   // of a reported joint, rad or m
constexpr double slowest = 1e-4;     // rad/s or m/s: an arm that goes slower rests

Vector6d vector_of(const double* joints) { return Eigen::Map<const Vector6d>(joints); }

}  // namespace

void ArmTrack::add(const arm_command_t& command) {
  if (command.action != arm_command_t::STREAM) return;
  if (!commands_.empty() && command.utime <= commands_.back().utime) return;
  commands_.push_back({command.utime, vector_of(command.joint)});
}

void ArmTrack::add(const arm_state_t& state) {
  if (!state.valid) return;
  clocks_.push_back({state.utime, state.clock_offset_s, state.clock_offset_sigma_s});
  round_trips_.push_back(seconds(state.utime_received - state.utime_sent));
  if (state.state != arm_state_t::RUNNING) return;
  const Vector6d sigma = vector_of(state.reported_joint_sigma).cwiseMax(min_sigma);
  readings_.push_back(
      {{state.utime, vector_of(state.reported_joint)}, sigma.cwiseAbs2().cwiseInverse()});
}

std::optional<Vector6d> ArmTrack::commanded(Utime utime) const {
  const auto after = std::lower_bound(commands_.begin(), commands_.end(), utime,
                                      [](const Point& point, Utime t) { return point.utime < t; });
  if (after == commands_.end() || after == commands_.begin()) return std::nullopt;
  const Point& before = *std::prev(after);
  if (after->utime - before.utime > max_gap) return std::nullopt;
  const double s =
      static_cast<double>(utime - before.utime) / static_cast<double>(after->utime - before.utime);
  return Vector6d(before.joints + s * (after->joints - before.joints));
}

std::vector<DelaySample> ArmTrack::samples(double delay) const {
  const std::size_t stride = readings_.size() / max_samples + 1;
  std::vector<DelaySample> list;
  for (std::size_t i = 0; i < readings_.size(); i += stride) {
    const Utime told = readings_[i].at.utime - utime_from_seconds(delay);
    const auto here = commanded(told);
    const auto before = commanded(told - rate_window / 2);
    const auto after = commanded(told + rate_window / 2);
    if (!here || !before || !after) continue;
    DelaySample sample;
    sample.utime = readings_[i].at.utime;
    sample.error = readings_[i].at.joints - *here;
    sample.rate = (*after - *before) / seconds(rate_window);
    sample.information = readings_[i].information.asDiagonal();
    sample.nuisances = Matrix6d::Identity();
    list.push_back(sample);
  }
  return list;
}

DelayFit ArmTrack::following_delay() const {
  const std::vector<DelaySample> stamped = samples(0);
  const bool moves = std::any_of(stamped.begin(), stamped.end(), [](const DelaySample& sample) {
    return sample.rate.cwiseAbs().maxCoeff() > slowest;
  });
  if (!moves) {
    DelayFit none;
    none.samples = stamped.size();
    return none;
  }
  DelayProblem problem;
  problem.nuisance_sigma = Vector6d::Constant(zero_sigma);
  problem.samples = [this](double delay) { return samples(delay); };
  return fit_delay(problem);
}

}  // namespace berth::evaluation
