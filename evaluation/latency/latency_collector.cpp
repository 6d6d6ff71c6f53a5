// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/latency/latency_collector.h"

#include <algorithm>
#include <berth/lidar_state_t.hpp>
#include <cmath>
#include <limits>

#include "common/core/statistics.h"
#include "common/core/text.h"
#include "evaluation/latency/estimate_delay.h"
#include "lcmtypes/channels.h"

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
    const Utime true_time = readings_[i].at.utime - utime_from_seconds(delay);
    const auto here = commanded(true_time);
    const auto before = commanded(true_time - rate_window / 2);
    const auto after = commanded(true_time + rate_window / 2);
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

namespace {

constexpr double two_sided = 1.96;  // standard deviations of a 95 % interval

Latency latency_of(const std::string& name, const DelayFit& fit, const std::string& remark) {
  Latency latency;
  latency.name = name;
  latency.value = fit.delay;
  latency.low = fit.delay - fit.half_width;
  latency.high = fit.delay + fit.half_width;
  latency.sigma_information = fit.sigma_information;
  latency.sigma_bootstrap = fit.sigma_bootstrap;
  latency.sigma_offset = fit.sigma_offset;
  latency.samples = fit.samples;
  latency.remark = remark;
  return latency;
}

std::string remark_of(const DelayFit& fit) {
  if (std::isnan(fit.delay)) return "not observable: the arm was not moved";
  return fit.half_width > widest_delay_interval ? "not observable: the arm was moved too little"
                                                : "";
}

/// How much later the sensor arm carries out set-points than the replica arm.
Latency between(const DelayFit& replica, const DelayFit& sensor) {
  DelayFit both;
  both.delay = sensor.delay - replica.delay;
  both.half_width = std::hypot(sensor.half_width, replica.half_width);
  both.sigma_information = std::hypot(sensor.sigma_information, replica.sigma_information);
  both.sigma_bootstrap = std::hypot(sensor.sigma_bootstrap, replica.sigma_bootstrap);
  both.samples = std::min(sensor.samples, replica.samples);
  return latency_of("sensor arm behind replica arm", both, remark_of(both));
}

/// Parts of one, by a straight line through the offsets.
double drift_of(const std::vector<ArmTrack::Clock>& clocks) {
  std::vector<double> t;
  std::vector<double> offset;
  for (const auto& c : clocks) {
    t.push_back(seconds(c.utime - clocks.front().utime));
    offset.push_back(c.offset);
  }
  const double spread = covariance(t, t);
  return spread > 0 ? covariance(t, offset) / spread : 0;
}

void add_clock(const std::string& name, const std::vector<ArmTrack::Clock>& clocks,
               std::vector<Latency>& list) {
  if (clocks.empty() || clocks.back().sigma <= 0) return;
  const ArmTrack::Clock& last = clocks.back();
  Latency latency;
  latency.name = name;
  latency.kind = Latency::Kind::clock;
  latency.value = last.offset;
  latency.low = last.offset - two_sided * last.sigma;
  latency.high = last.offset + two_sided * last.sigma;
  latency.samples = clocks.size();
  latency.remark = "drift " + fixed(1e6 * drift_of(clocks), 1) + " ppm";
  list.push_back(latency);
}

void add_trips(const std::string& name, std::vector<double> trips, std::vector<Latency>& list) {
  if (trips.empty()) return;
  std::sort(trips.begin(), trips.end());
  const auto at = [&](double share) {
    return trips[static_cast<std::size_t>(share * static_cast<double>(trips.size() - 1))];
  };
  Latency latency;
  latency.name = name;
  latency.kind = Latency::Kind::trip;
  latency.value = at(0.5);
  latency.low = at(0.025);
  latency.high = at(0.975);
  latency.samples = trips.size();
  list.push_back(latency);
}

}  // namespace

void LatencyCollector::take(const logs::LogEvent& event) {
  const auto arm = [&](const char* state, const char* command, ArmTrack Session::*track) {
    if (event.channel == state) {
      if (const auto m = logs::decode<arm_state_t>(event.data))
        (sessions_[m->session].*track).add(*m);
    } else if (event.channel == command) {
      if (const auto m = logs::decode<arm_command_t>(event.data))
        (sessions_[m->session].*track).add(*m);
    }
  };
  arm(channels::arm_state_replica, channels::arm_command_replica, &Session::replica);
  arm(channels::arm_state_sensor, channels::arm_command_sensor, &Session::sensor);
  const auto m = logs::decode<lidar_state_t>(event, channels::lidar_state);
  if (m && m->clock_offset_sigma_s > 0) {
    sessions_[m->session].lidar.push_back({m->utime, m->clock_offset_s, m->clock_offset_sigma_s});
  }
}

std::vector<Latency> LatencyCollector::latencies(const Measurer& measurer) const {
  std::vector<Latency> list;
  if (const auto whole = measurer.record().phase(whole_run)) {
    const EstimateDelay scans = estimate_delay(measurer, *whole, EstimatePose::measured);
    const EstimateDelay filtered = estimate_delay(measurer, *whole, EstimatePose::filtered);
    if (!measurer.compared().empty()) {
      list.push_back(
          latency_of("LIDAR behind arms, single scans", scans.fit, scans.not_observable));
      list.push_back(
          latency_of("estimates behind arms, filtered", filtered.fit, filtered.not_observable));
    }
  }
  const auto* info = measurer.record().info();
  const auto found = info ? sessions_.find(info->session) : sessions_.end();
  if (found == sessions_.end()) return list;
  const Session& session = found->second;
  const DelayFit replica = session.replica.following_delay();
  const DelayFit sensor = session.sensor.following_delay();
  if (replica.samples > 0) {
    list.push_back(latency_of("replica arm behind its set-points", replica, remark_of(replica)));
  }
  if (sensor.samples > 0) {
    list.push_back(latency_of("sensor arm behind its set-points", sensor, remark_of(sensor)));
  }
  if (replica.samples > 0 && sensor.samples > 0) list.push_back(between(replica, sensor));
  add_trips("replica arm, status read", session.replica.round_trips(), list);
  add_trips("sensor arm, status read", session.sensor.round_trips(), list);
  add_clock("replica controller's clock minus host's", session.replica.clocks(), list);
  add_clock("sensor controller's clock minus host's", session.sensor.clocks(), list);
  add_clock("LIDAR's clock minus host's", session.lidar, list);
  return list;
}

}  // namespace berth::evaluation
