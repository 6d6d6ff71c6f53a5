// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_instruments.h"

#include <cmath>

#include "common/core/error.h"
#include "common/core/text.h"

namespace berth {
namespace {

/// Half of the interval of a difference quotient: the controllers' interpolation period.
constexpr Utime half_interval = 4 * millisecond;

}  // namespace

SimulatedInertial::SimulatedInertial(const Options& options, std::uint64_t seed, SensorPose sensor,
                                     Loop& loop, Publish publish)
    : options_(options),
      random_(seed, "inertial unit"),
      sensor_(std::move(sensor)),
      loop_(loop),
      publish_(std::move(publish)),
      acceleration_bias_(random_.normal_vector(options.acceleration_bias)),
      turn_rate_bias_(random_.normal_vector(options.turn_rate_bias)) {
  timer_ = loop.every(options_.period, [this] { measure(); });
}

SimulatedInertial::~SimulatedInertial() { loop_.cancel(timer_); }

/// Of the sensor in the cell; angular velocity in the sensor's own axes.
Velocity SimulatedInertial::true_velocity(Utime t) const {
  const Pose before = sensor_(t - half_interval);
  const Pose after = sensor_(t + half_interval);
  const Velocity in_cell = velocity_between(before, after, seconds(2 * half_interval));
  return {in_cell.linear, after.rotation.conjugate() * in_cell.angular};
}

void SimulatedInertial::measure() {
  const Utime t = loop_.now() - half_interval;
  const Velocity after = true_velocity(t);
  const Velocity before = last_velocity_;
  const std::optional<Utime> since = last_;
  last_ = t;
  last_velocity_ = after;
  if (!since) return;
  const double dt = seconds(t - *since);
  const double velocity_sigma = options_.velocity_noise * std::sqrt(dt);
  const double turn_rate_sigma = options_.turn_rate_noise * std::sqrt(dt);
  const Vector3d change = sensor_(t).rotation.conjugate() * (after.linear - before.linear) +
                          acceleration_bias_ * dt + random_.normal_vector(velocity_sigma);
  const Vector3d turn = after.angular + turn_rate_bias_;
  const Vector3d turn_change =
      after.angular - before.angular + random_.normal_vector(turn_rate_sigma);

  inertial_motion_t message{};
  message.utime = t;
  message.seq = ++seq_;
  message.interval_us = t - *since;
  Vector3d::Map(message.velocity_change_m_s) = change;
  Vector3d::Map(message.angular_velocity_rad_s) = turn;
  Vector3d::Map(message.angular_velocity_change_rad_s) = turn_change;
  message.velocity_change_sigma_m_s = velocity_sigma;
  message.angular_velocity_change_sigma_rad_s = turn_rate_sigma;
  publish_(message);
}

SimulatedTracker::SimulatedTracker(const TrackerSetup& setup, const Options& options,
                                   std::uint64_t seed, ToolPose tool, Loop& loop,
                                   const std::filesystem::path& file)
    : setup_(setup),
      to_tracker_(options.place.inverse()),
      random_(seed, "laser tracker"),
      tool_(std::move(tool)),
      loop_(loop),
      file_(file) {
  if (!file_) throw InputError(file.string() + ": cannot be written");
  file_ << "time,point,x,y,z\n";
  timer_ = loop.every(options.period, [this] { measure(); });
}

SimulatedTracker::~SimulatedTracker() { loop_.cancel(timer_); }

void SimulatedTracker::measure() {
  const Utime t = loop_.now();
  const Reflector& reflector = setup_.reflectors[next_];
  next_ = (next_ + 1) % setup_.reflectors.size();
  const Vector3d point = to_tracker_ * (tool_(reflector.on, t) * reflector.place);
  const Vector3d seen = point + random_.normal_vector(setup_.sigma_at(point.norm()));
  file_ << fixed(seconds(t), 6) << ',' << reflector.name;
  for (int i = 0; i < 3; ++i) file_ << ',' << fixed(1e3 * seen[i], 4);
  file_ << '\n';
}

}  // namespace berth
