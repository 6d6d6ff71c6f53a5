// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/forecast.h"

#include <algorithm>
#include <vector>

#include "common/core/text.h"

namespace berth::testbed {
namespace {

constexpr std::int64_t forecast_step = 33333;  // us
constexpr std::int64_t scan_period = 1000000;  // us
/// us from the time of an estimate to its arrival: half a scan and computing.
constexpr std::int64_t latency = 700000;
constexpr double max_time = 900;  // s
/// s that a pose is kept after the target has come to rest.
constexpr double keep_on = 5;

/// Poses at even times.
class SampledPath final : public RelativePath {
 public:
  SampledPath(std::vector<Pose> poses, double spacing)
      : poses_(std::move(poses)), spacing_(spacing) {}

  double duration() const override { return spacing_ * static_cast<double>(poses_.size() - 1); }
  Point at(double t) const override {
    if (poses_.size() == 1) return {poses_.front(), 1};
    const double place = std::clamp(t / spacing_, 0.0, static_cast<double>(poses_.size() - 1));
    const auto i = std::min(static_cast<std::size_t>(place), poses_.size() - 2);
    const double x = std::clamp(t / duration(), 0.0, 1.0);
    return {interpolate(poses_[i], poses_[i + 1], place - static_cast<double>(i)),
            x * x * (3 - 2 * x)};
  }

 private:
  std::vector<Pose> poses_;
  double spacing_;
};

}  // namespace

std::variant<std::shared_ptr<const RelativePath>, std::string> forecast(const Flight& flight,
                                                                        const TargetMotion& motion,
                                                                        std::int64_t now,
                                                                        std::int64_t dead_time) {
  Flight twin = flight;
  // the same error, fixed to the target, goes on as the first estimate had it
  const Pose& seen_as = flight.first_target_pose();
  const double keep_until = (motion ? motion->duration() : 0) + keep_on;
  const double dt = 1e-6 * static_cast<double>(forecast_step);
  std::vector<Pose> poses{twin.commanded()};
  for (std::int64_t t = forecast_step;; t += forecast_step) {
    const double time = 1e-6 * static_cast<double>(t);
    if (time > max_time) return "it would not arrive within " + fixed(max_time / 60, 0) + " min";
    if (t % scan_period < forecast_step && t > latency + dead_time) {
      const auto shown = std::max<std::size_t>(
          1, static_cast<std::size_t>((t - latency - dead_time) / forecast_step));
      Estimate estimate;
      // the pose there is the one commanded at a whole step
      estimate.utime = now + static_cast<std::int64_t>(shown) * forecast_step + dead_time;
      estimate.dead_time = dead_time;
      estimate.pose = poses[shown] * seen_as;
      estimate.velocity = velocity_between(poses[shown - 1] * seen_as, estimate.pose, dt);
      estimate.usable = true;
      twin.on_estimate(estimate);
    }
    const Steering::Output output = twin.step(now + t, dt);
    poses.push_back(output.commanded * target_at(motion, time));
    if (output.phase == Steering::Phase::aborted) {
      return "even with perfect estimates it would be given up " + fixed(time, 1) +
             " s after the start: " + output.reason;
    }
    if (output.phase == Steering::Phase::done || (flight.keeps() && time > keep_until)) break;
  }
  return std::make_shared<const SampledPath>(std::move(poses), dt);
}

}  // namespace berth::testbed
