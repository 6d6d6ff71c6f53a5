// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdio>

#include "common/core/config.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

/// Logs written before SETPOINT_LATENCY have it as an event.
std::optional<Utime> latency_in_old_event(const event_t& event) {
  double ms = 0;
  const bool found =
      event.code == "dead-time" &&
      std::sscanf(event.text.c_str(), "a dead time of %lf ms is reckoned with", &ms) == 1;
  return found ? std::optional<Utime>(std::llround(1e3 * ms)) : std::nullopt;
}

/// The dead time that the testbed used last: the longer the arms have moved the more precise it is.
/// Not after the newest truth, so that late messages do not count.
std::optional<Utime> measured_dead_time(const RunRecord& record) {
  if (record.truth().samples().empty()) return std::nullopt;
  const Utime newest = record.truth().samples().back().utime;
  std::optional<Utime> dead;
  for (const setpoint_latency_t& message : record.setpoint_latencies()) {
    if (message.utime <= newest) dead = utime_from_seconds(message.latency_s);
  }
  if (!record.setpoint_latencies().empty()) return dead;
  for (const event_t& event : record.events()) {
    if (event.utime > newest) continue;
    if (const auto latency = latency_in_old_event(event)) dead = latency;
  }
  return dead;
}

/// The nominal one in the run's own configuration; nothing when the log does not hold it.
std::optional<Utime> nominal_dead_time(const RunRecord& record) {
  if (!record.info()) return std::nullopt;
  for (const attachment_t& file : record.info()->attachments) {
    if (file.name != "testbed.yaml" || file.content.empty()) continue;
    Config config = Config::parse(file.content, file.name);
    Config setpoints = config.section("setpoints");
    return utime_from_seconds(setpoints.quantity("dead_time", Dimension::time));
  }
  return std::nullopt;
}

using OfDifference = Uncertain (*)(const Vector6d&, const Matrix6d&);

/// True pose against the one that was commanded a dead time before.
template <OfDifference value>
Series following(const Measurer& measurer, const Phase& phase) {
  Series series;
  auto dead = measured_dead_time(measurer.record());
  if (!dead) dead = nominal_dead_time(measurer.record());
  if (!dead) {
    series.reason = "the log does not hold the testbed's configuration";
    return series;
  }
  for (const CommandedSample& commanded : measurer.record().commanded()) {
    const Utime at = commanded.utime + *dead;
    if (!phase.contains(at)) continue;
    const auto truth = measurer.record().truth().at(at);
    if (!truth) {
      ++series.without_truth;
      continue;
    }
    const Uncertain v = value(difference(commanded.pose, truth->pose), truth->covariance);
    series.utime.push_back(at);
    series.value.push_back(v.value);
    series.truth_sigma.push_back(v.truth_sigma);
  }
  return series;
}

Uncertain position(const Vector6d& away, const Matrix6d& covariance) {
  return length_of(away.head<3>(), covariance.topLeftCorner<3, 3>());
}
Uncertain attitude(const Vector6d& away, const Matrix6d& covariance) {
  return length_of(away.tail<3>(), covariance.bottomRightCorner<3, 3>());
}

}  // namespace

void add_following(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("commanded and achieved", table);
  family.series("achieved_position_error", berth::Dimension::length, smaller_is_better,
                following<position>,
                "true position against the one the arms were commanded to a dead time before");
  family.series("achieved_attitude_error", berth::Dimension::angle, smaller_is_better,
                following<attitude>, "true attitude against the one commanded a dead time before");
}

}  // namespace berth::evaluation
