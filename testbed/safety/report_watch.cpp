// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety/report_watch.h"

#include <cmath>

#include "common/core/text.h"

namespace berth::testbed {
namespace {

/// us that two samples' times may be wrong by, against each other.
constexpr std::int64_t time_error = 10000;
/// us after which nothing is said of the way between two samples.
constexpr std::int64_t max_gap = 1000000;
/// us that a mapped clock may go back by itself.
constexpr std::int64_t clock_error = 1000000;

}  // namespace

std::optional<Contradiction> ReportWatch::look(const Report& report) {
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
    const double most = arm_.limits()[i].speed * static_cast<double>(between + time_error) * 1e-6 +
                        6 * (report.sigma[i] + before->sigma[i]);
    const double step = std::abs(now[i] - then[i]);
    if (step <= most) continue;
    const bool linear = arm_.is_linear(static_cast<int>(i));
    const auto shown = [&](double value) {
      return linear ? fixed(1e3 * value, 1) + " mm" : fixed(degrees(value), 2) + " deg";
    };
    return Contradiction{"arm-jumped", name_ + "'s joint " + std::to_string(i + 1) +
                                           " was reported " + shown(step) + " further within " +
                                           fixed(static_cast<double>(between) * 1e-3, 0) +
                                           " ms; it can go " + shown(most)};
  }
  return std::nullopt;
}

}  // namespace berth::testbed
