// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_plc.h"

#include <algorithm>

namespace berth {
namespace {

constexpr int plc_registers = 1000;
constexpr int bit_count = 64;
constexpr Utime cycle = 10 * millisecond;

}  // namespace

SimulatedPlc::SimulatedPlc(const std::string& address, const PlcMap& map, Options options,
                           Loop& loop, SafetyChanged changed)
    : map_(map),
      options_(options),
      loop_(loop),
      started_(loop.now()),
      changed_(std::move(changed)),
      sun_{1 / seconds(options.lamp_rise), 0, 0, 0},
      albedo_{sun_},
      azimuth_{options.lamp_turn, 0, 0, 0},
      elevation_{azimuth_},
      image_(plc_registers, bit_count, bit_count),
      server_(serve_registers(
          loop, {address, map.unit, options.connections, options.idle_timeout}, image_,
          [this](RegisterTable, int, int) { before_read(); },
          [this](RegisterTable, int, int) { after_write(); })) {}

void SimulatedPlc::press_estop(bool pressed) {
  estop_closed_ = !pressed;
  if (changed_) changed_(estop_closed_, fence_closed_);
}

void SimulatedPlc::open_fence(bool open) {
  fence_closed_ = !open;
  if (changed_) changed_(estop_closed_, fence_closed_);
}

double SimulatedPlc::Ramp::at(Utime now) const {
  const double way = rate * seconds(now - since);
  return from + std::clamp(to - from, -way, way);
}

void SimulatedPlc::Ramp::go(double value, Utime now) {
  if (value == to) return;
  *this = {rate, at(now), value, now};
}

void SimulatedPlc::before_read() {
  image_.holding(map_.safety) = static_cast<Word>(
      (estop_closed_ ? 1 << map_.estop_bit : 0) | (fence_closed_ ? 1 << map_.fence_bit : 0) |
      (estop_closed_ && fence_closed_ ? 1 << map_.motion_bit : 0));
  image_.holding(map_.sun_lamp.status) = word_from_level(sun_lamp());
  image_.holding(map_.albedo_lamp.status) = word_from_level(albedo_lamp());
  image_.holding(map_.sun_azimuth.status) = word_from_angle(sun_azimuth());
  image_.holding(map_.sun_elevation.status) = word_from_angle(sun_elevation());
  image_.holding(map_.heartbeat) = static_cast<Word>((loop_.now() - started_) / cycle);
}

void SimulatedPlc::after_write() {
  const Utime now = loop_.now();
  sun_.go(level_from_word(image_.holding(map_.sun_lamp.command)), now);
  albedo_.go(level_from_word(image_.holding(map_.albedo_lamp.command)), now);
  azimuth_.go(angle_from_word(image_.holding(map_.sun_azimuth.command)), now);
  elevation_.go(angle_from_word(image_.holding(map_.sun_elevation.command)), now);
}

}  // namespace berth
