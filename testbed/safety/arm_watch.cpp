// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety/arm_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/text.h"
#include "testbed/motion/arm_pair.h"

namespace berth::testbed {
namespace {

/// us, largest relative error of two samples' times.
constexpr std::int64_t time_error = 10000;
/// us between two samples beyond which their step is not judged.
constexpr std::int64_t max_gap = 1000000;
/// us by which a mapped clock may step back without a restart.
constexpr std::int64_t clock_error = 1000000;

/// us between the delays that are tested.
constexpr std::int64_t delay_step = 5000;
/// us between two samples of the delay's identification, and the greatest weight of one.
constexpr std::int64_t learning_period = 40000;
constexpr std::int64_t max_weight = 100000;
/// s, of the second J.
constexpr double recent_memory = 1;
/// s times squared limits: see the class.
constexpr double significant_residual = 0.1 * 0.1 * 1.0;

}  // namespace

std::optional<Contradiction> ReportWatch::check(const Report& report) {
  const std::optional<Report> before = last_;
  last_ = report;
  if (!before) return std::nullopt;
  if (report.controller_time < before->controller_time - clock_error) {
    return Contradiction{
        "arm-restarted",
        name_ + "'s controller was started anew: its clock went back by " +
            fixed(static_cast<double>(before->controller_time - report.controller_time) * 1e-6, 1) +
            " s"};
  }
  const std::int64_t between = report.utime - before->utime;
  if (between <= 0 || between > max_gap) return std::nullopt;
  // the limits are those of the motors: compare what these turned by
  const Joints now = arm_.motor_joints(report.joints);
  const Joints then = arm_.motor_joints(before->joints);
  for (std::size_t i = 0; i < 6; ++i) {
    const double max_step =
        arm_.limits()[i].speed * static_cast<double>(between + time_error) * 1e-6 +
        6 * (report.sigma[i] + before->sigma[i]);
    const double step = std::abs(now[i] - then[i]);
    if (step <= max_step) continue;
    const bool linear = arm_.is_linear(static_cast<int>(i));
    const auto shown = [&](double value) {
      return linear ? fixed(1e3 * value, 1) + " mm" : fixed(degrees(value), 2) + " deg";
    };
    return Contradiction{"arm-jumped", name_ + "'s joint " + std::to_string(i + 1) +
                                           " was reported " + shown(step) + " further within " +
                                           fixed(static_cast<double>(between) * 1e-3, 0) +
                                           " ms; it can go " + shown(max_step)};
  }
  return std::nullopt;
}

FollowingWatch::FollowingWatch(ArmRole role, const ArmKinematics& arm, const Settings& settings)
    : role_(role), arm_(arm), settings_(settings) {
  begin();
}

void FollowingWatch::begin() {
  residual_.assign(static_cast<std::size_t>(settings_.max_dead_time / delay_step) + 1, 0);
  recent_ = residual_;
  dead_time_ = {0, 0, settings_.max_dead_time};
  learned_ = 0;
}

double FollowingWatch::limit(std::size_t joint) const {
  return arm_.is_linear(static_cast<int>(joint)) ? settings_.largest_linear_lag
                                                 : settings_.largest_lag;
}

std::optional<Contradiction> FollowingWatch::check(std::int64_t t, double time_sigma,
                                                   const Joints& reported,
                                                   const JointHistory& commands) {
  if (t - learned_ >= learning_period) learn(t, reported, commands);
  const auto margin = static_cast<std::int64_t>(std::ceil(3e6 * time_sigma)) + delay_step;
  double min_share = std::numeric_limits<double>::infinity();  // of the limit
  std::size_t joint = 0;
  double away = 0;
  const std::int64_t max_delay = dead_time_.max + margin;
  for (std::int64_t d = dead_time_.min - margin; d <= max_delay && min_share > 1; d += delay_step) {
    const auto commanded = commands.at(t - d);
    if (!commanded) return std::nullopt;
    const Joints& reference = commanded->of(role_);
    std::size_t worst = 0;
    double share = 0;
    for (std::size_t j = 0; j < 6; ++j) {
      const double of_limit = std::abs(reported[j] - reference[j]) / limit(j);
      if (of_limit <= share) continue;
      share = of_limit;
      worst = j;
    }
    if (share >= min_share) continue;
    min_share = share;
    joint = worst;
    away = std::abs(reported[worst] - reference[worst]);
  }
  if (min_share <= 1) return std::nullopt;
  const bool linear = arm_.is_linear(static_cast<int>(joint));
  return Contradiction{
      "arm-strays", arm_name(role_) + "'s joint " + std::to_string(joint + 1) + " is " +
                        (linear ? fixed(1e3 * away, 0) + " mm" : fixed(degrees(away), 1) + " deg") +
                        " away from its commanded position"};
}

void FollowingWatch::learn(std::int64_t t, const Joints& reported, const JointHistory& commands) {
  const double weight = 1e-6 * static_cast<double>(std::min(t - learned_, max_weight));
  const double fading = std::exp(-1e-6 * static_cast<double>(t - learned_) / recent_memory);
  for (double& residual : recent_) residual *= fading;
  learned_ = t;
  const auto newest = commands.at(t);
  const auto oldest = commands.at(t - settings_.max_dead_time);
  if (!newest || !oldest || max_change(*newest, *oldest) < 1e-6) return;  // without information
  Joints limits{};
  for (std::size_t j = 0; j < 6; ++j) limits[j] = limit(j);
  for (std::size_t i = 0; i < residual_.size(); ++i) {
    const auto commanded = commands.at(t - static_cast<std::int64_t>(i) * delay_step);
    const Joints& reference = (commanded ? *commanded : *newest).of(role_);
    double sum = 0;
    for (std::size_t j = 0; j < 6; ++j) {
      const double of_limit = (reported[j] - reference[j]) / limits[j];
      sum += of_limit * of_limit;
    }
    residual_[i] += weight * sum;
    recent_[i] += weight * sum;
  }
  auto best = std::min_element(residual_.begin(), residual_.end());
  const double of_late = recent_[static_cast<std::size_t>(best - residual_.begin())];
  if (of_late > *std::min_element(recent_.begin(), recent_.end()) + significant_residual) {
    residual_ = recent_;  // the delay has changed
    best = std::min_element(residual_.begin(), residual_.end());
  }
  const auto plausible = [&](double residual) { return residual <= *best + significant_residual; };
  const auto first = std::find_if(residual_.begin(), residual_.end(), plausible);
  const auto last = std::prev(std::find_if(residual_.rbegin(), residual_.rend(), plausible).base());
  const auto delay = [&](auto place) { return (place - residual_.begin()) * delay_step; };
  dead_time_ = {delay(best) + beyond(static_cast<std::size_t>(best - residual_.begin())),
                delay(first), delay(last)};
}

/// us from the best delay tested to the minimum of the parabola through it and its neighbours.
std::int64_t FollowingWatch::beyond(std::size_t best) const {
  if (best == 0 || best + 1 == residual_.size()) return 0;
  const double before = residual_[best - 1];
  const double after = residual_[best + 1];
  const double curvature = before - 2 * residual_[best] + after;
  if (!(curvature > 0)) return 0;
  return std::llround(0.5 * (before - after) / curvature * static_cast<double>(delay_step));
}

}  // namespace berth::testbed
