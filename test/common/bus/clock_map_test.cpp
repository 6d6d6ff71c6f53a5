// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/clock_map.h"

#include <algorithm>
#include <cmath>

#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;

namespace {

/// A device whose clock runs fast by `drift`, shown in steps of `resolution`, read every `period`
/// over a wire with uneven delays.
struct Device {
  struct Reading {
    Utime sent, received;
    std::int64_t shown;
    Utime shown_at;  // host time at which the device's clock was at `shown`
  };
  Reading read() {
    const Utime sent = host + static_cast<Utime>(random.uniform(-500, 500));
    const Utime there = sent + static_cast<Utime>(random.uniform(100, 400));
    const Utime received = there + static_cast<Utime>(random.uniform(100, 900));
    const double clock = at_begin + static_cast<double>(there - begin) * (1 + drift);
    const auto shown = static_cast<std::int64_t>(clock / resolution) * resolution;
    const auto back = (static_cast<double>(shown) - at_begin) / (1 + drift);
    host += period;
    return {sent, received, shown, begin + static_cast<Utime>(std::llround(back))};
  }
  /// The clock goes on from where it is, at another rate.
  void change_drift(double to) {
    at_begin += static_cast<double>(host - begin) * (1 + drift);
    begin = host;
    drift = to;
  }

  Utime period = 10 * millisecond;
  Utime resolution = 8 * millisecond;
  double drift = 2e-5;
  Utime begin = 1000 * second;
  Utime host = begin;
  double at_begin = 3600e6;
  Random random{5, "clock test"};
};

struct Errors {
  double rms = 0;             ///< s
  double rms_in_sigmas = 0;   ///< of the stated ones
  double worst_interval = 0;  ///< s, of the time between two placed readings
};

/// Reads for so many readings and judges all but the first ones.
Errors follow(ClockMap& map, Device& device, int readings, int settling) {
  Errors errors;
  double last_error = 0;
  for (int i = 0; i < readings; ++i) {
    const Device::Reading r = device.read();
    map.add(r.sent, r.shown, r.received);
    const double error = seconds(map.line().to_host(r.shown) - r.shown_at);
    if (i > settling) {
      errors.rms += error * error;
      errors.rms_in_sigmas += std::pow(error / map.line().sigma_s, 2);
      errors.worst_interval = std::max(errors.worst_interval, std::abs(error - last_error));
    }
    last_error = error;
  }
  const double n = readings - settling - 1;
  errors.rms = std::sqrt(errors.rms / n);
  errors.rms_in_sigmas = std::sqrt(errors.rms_in_sigmas / n);
  return errors;
}

}  // namespace

TEST_CASE("a clock that drifts is followed without jumps, within the stated uncertainty") {
  for (const double ppm : {-500.0, -80.0, 0.0, 20.0, 100.0, 500.0}) {
    for (const Utime resolution : {Utime{1}, 8 * millisecond}) {
      Device device;
      device.drift = ppm * 1e-6;
      device.resolution = resolution;
      ClockMap map(resolution);
      const Errors errors = follow(map, device, 6000, 300);
      CAPTURE(ppm, resolution);
      CHECK(errors.rms < 250e-6);
      CHECK(errors.rms_in_sigmas < 1);
      CHECK(errors.worst_interval < 600e-6);
      CHECK(map.line().drift == Approx(ppm * 1e-6).margin(30e-6));
    }
  }
}

TEST_CASE("a drift that changes is learnt anew, without a jump of the clock") {
  Device device;
  ClockMap map(device.resolution);
  follow(map, device, 3000, 300);
  device.change_drift(450e-6);
  const Errors errors = follow(map, device, 3000, 0);
  CHECK(errors.rms < 500e-6);
  CHECK(errors.worst_interval < millisecond * 1e-6);
  CHECK(map.line().drift == Approx(450e-6).margin(30e-6));
}

TEST_CASE("a clock that was set is reported, and the old estimate is forgotten") {
  Device device;
  ClockMap map(device.resolution);
  follow(map, device, 500, 0);
  for (const double step : {60e3, -60e3, 3600e6}) {
    device.at_begin += step;
    const Device::Reading r = device.read();
    CHECK_FALSE(map.add(r.sent, r.shown, r.received));
    const Errors errors = follow(map, device, 500, 100);
    CHECK(errors.rms < 500e-6);
    const Device::Reading next = device.read();
    CHECK(map.add(next.sent, next.shown, next.received));
  }
}

TEST_CASE("the tightest brackets decide, with their uncertainty") {
  ClockMap map;
  CHECK_FALSE(map.valid());
  map.add(1000, 501500, 2000);  // 1 ms wide: offset 500000
  CHECK(map.line().offset == 500000);
  CHECK(map.line().sigma_s == Approx(1002e-6 / std::sqrt(12.0)));
  map.add(3000, 503110, 3200);  // 0.2 ms wide: offset 500010
  CHECK(map.line().offset == 500010);
  map.add(5000, 506000, 9000);
  CHECK(std::abs(map.line().offset - 500010) < 5);
  CHECK(std::abs(map.line().to_host(500110) - 100) < 5);
  map.clear();
  CHECK_FALSE(map.valid());
}

TEST_CASE("a line maps device times to host times") {
  const ClockLine line{1000000, 7000000, 1e-4, 0};
  CHECK(line.to_host(8000000) == 1000000);
  CHECK(line.to_host(18001000) == 11000000);  // ten seconds on, one ms more
}
