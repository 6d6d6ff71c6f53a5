// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/node/messages.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/conversions.h"

namespace berth::estimator {

bool is_well_formed(const ScanPacket& packet) {
  constexpr std::int64_t end_of_time = 1'000'000'000'000'000'000;
  return packet.count >= 0 && packet.packet >= 0 && packet.packet < 1'000'000'000 &&
         packet.utime >= 0 && packet.utime < end_of_time && packet.scan_id > 0 &&
         packet.scan_id < end_of_time &&
         packet.time_us.size() == static_cast<std::size_t>(packet.count);
}

std::int64_t utime_of_end(const ScanPacket& packet) {
  return packet.time_us.empty() ? packet.utime : packet.utime + packet.time_us.back();
}

void append_beams(const ScanPacket& packet, std::vector<RawBeam>& beams) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(packet.count); ++i) {
    RawBeam beam;
    beam.utime = packet.utime + packet.time_us[i];
    const ScanPacket::Seen seen = packet.seen_from_sensor(i);
    beam.range = seen.range;
    beam.azimuth = seen.azimuth;
    beam.elevation = seen.elevation;
    beam.range_sigma = static_cast<double>(packet.range_sigma_m[i]);
    beam.intensity = packet.intensity[i];
    if (packet.range2_m[i] != 0) {
      // For a beam that does not start at the origin, the difference of ranges along the beam.
      beam.second_range = seen.range + static_cast<double>(packet.range2_m[i]) -
                          static_cast<double>(packet.range_m[i]);
      beam.second_range_sigma = static_cast<double>(packet.range2_sigma_m[i]);
      beam.second_intensity = packet.intensity2[i];
    }
    beam.status = packet.beam_status(i);
    beams.push_back(beam);
  }
}

bool is_well_formed(const inertial_motion_t& motion) {
  constexpr std::int64_t end_of_time = 1'000'000'000'000'000'000;
  bool finite = true;
  for (int i = 0; i < 3; ++i) {
    finite = finite && std::isfinite(motion.velocity_change_m_s[i]) &&
             std::isfinite(motion.angular_velocity_rad_s[i]) &&
             std::isfinite(motion.angular_velocity_change_rad_s[i]);
  }
  const auto is_sigma = [](double value) { return std::isfinite(value) && value >= 0; };
  return finite && motion.utime >= 0 && motion.utime < end_of_time && motion.interval_us > 0 &&
         motion.interval_us <= motion.utime && is_sigma(motion.velocity_change_sigma_m_s) &&
         is_sigma(motion.angular_velocity_change_sigma_rad_s);
}

SensorMotion sensor_motion_of(const inertial_motion_t& motion) {
  using Eigen::Map;
  SensorMotion m;
  m.begin = motion.utime - motion.interval_us;
  m.end = motion.utime;
  const double dt = static_cast<double>(motion.interval_us) * 1e-6;
  const Vector3d turn_change = Map<const Vector3d>(motion.angular_velocity_change_rad_s);
  m.acceleration = Map<const Vector3d>(motion.velocity_change_m_s) / dt;
  m.angular_velocity = Map<const Vector3d>(motion.angular_velocity_rad_s) - turn_change / 2;
  m.angular_acceleration = turn_change / dt;
  m.velocity_sigma = motion.velocity_change_sigma_m_s;
  m.angular_velocity_sigma = motion.angular_velocity_change_sigma_rad_s;
  return m;
}

std::string why_malformed(const estimator_command_t& command) {
  constexpr int max_returns = 1000000;
  const bool own_gate = command.gate_near_m == 0 && command.gate_far_m == 0;
  if (!own_gate && !(command.gate_near_m >= 0 && command.gate_far_m > command.gate_near_m)) {
    return "the range gate holds nothing";
  }
  if (command.returns_per_scan < 0 || command.returns_per_scan > max_returns) {
    return std::to_string(command.returns_per_scan) + " returns per scan, at most " +
           std::to_string(max_returns) + " are possible";
  }
  ScanStrategy strategy{};
  if (!command.strategy.empty() && !parse_scan_strategy(command.strategy, strategy)) {
    std::string names;
    for (const std::string& name : scan_strategy_names()) names += " " + name;
    return "scan strategy '" + command.strategy + "' is unknown, expected one of" + names;
  }
  if (command.command == estimator_command_t::TRACK && command.has_initial_pose) {
    if (!is_pose(command.initial_position_m, command.initial_q_wxyz)) {
      return "the initial pose is not valid";
    }
  }
  if (command.command == estimator_command_t::SCAN) {
    if (command.windows.empty()) return "a scan without windows";
    for (const scan_window_t& w : command.windows) {
      for (const double value :
           {w.azimuth_rad, w.elevation_rad, w.width_rad, w.height_rad, w.spacing_rad}) {
        if (!std::isfinite(value)) return "window '" + w.name + "' is not finite";
      }
    }
  }
  return "";
}

Matrix6d diagonal_covariance(double translation, double rotation) {
  Vector6d v;
  v << Vector3d::Constant(translation * translation), Vector3d::Constant(rotation * rotation);
  return v.asDiagonal();
}

void fill_measurement(const TrackingResult& measured, pose_estimate_t& estimate) {
  set_pose(with_positive_w(measured.pose), estimate.measured_position_m, estimate.measured_q_wxyz);
  estimate.returns_used = measured.used;
  estimate.iterations = measured.iterations;
  estimate.residual_rms_m = measured.residual_rms;
  estimate.confidence = measured.confidence;
}

void fill_hypotheses(const std::vector<Hypothesis>& hypotheses, pose_estimate_t& estimate) {
  for (const Hypothesis& h : hypotheses) {
    hypothesis_t& message = estimate.hypotheses.emplace_back();
    set_pose(with_positive_w(h.pose), message);
    message.probability = h.probability;
    message.log_likelihood = h.log_likelihood;
  }
  estimate.hypothesis_count = static_cast<std::int32_t>(estimate.hypotheses.size());
  if (hypotheses.empty()) return;
  const Pose best = with_positive_w(hypotheses.front().pose);
  set_pose(best, estimate);
  set_pose(best, estimate.measured_position_m, estimate.measured_q_wxyz);
}

}  // namespace berth::estimator
