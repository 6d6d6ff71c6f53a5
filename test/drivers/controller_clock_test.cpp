// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/controller_clock.h"

#include <cmath>

#include "common/core/random.h"
#include "test/catch.h"

namespace berth {
namespace {

/// Reads a controller whose clock is `offset` ahead and runs fast by `drift`, every 10 ms with an
/// uneven round trip.
struct Reader {
  int read(ControllerClock& clock, Utime& truth_out) {
    host += 10 * millisecond + static_cast<Utime>(random.uniform(-500, 500));
    const Utime sent = host;
    const Utime sampled = sent + static_cast<Utime>(random.uniform(100, 400));
    const Utime received = sampled + static_cast<Utime>(random.uniform(100, 900));
    const auto controller =
        static_cast<Utime>(static_cast<double>(sampled - begin) * (1 + drift)) + offset;
    const Utime tick = controller / (8 * millisecond) * (8 * millisecond);
    const int tick_ms = static_cast<int>(tick / millisecond % wrap);
    truth_out = begin + static_cast<Utime>(static_cast<double>(tick - offset) / (1 + drift));
    last = clock.add(tick_ms, sent, received);
    return tick_ms;
  }
  static constexpr int wrap = 1 << 24;
  static constexpr Utime begin = 1000 * second;
  Random random{5, "clock test"};
  Utime host = begin;
  Utime offset = 3600 * second;
  double drift = 2e-5;
  Utime last = 0;
};

TEST_CASE("the controller's tick is placed on the host's clock within its stated uncertainty") {
  Reader reader;
  ControllerClock clock(8 * millisecond, Reader::wrap);
  double square_error = 0;
  double square_sigma = 0;
  int n = 0;
  for (int i = 0; i < 3000; ++i) {
    Utime truth = 0;
    reader.read(clock, truth);
    if (i < 200) continue;
    const double error = seconds(clock.host_time(reader.last) - truth);
    square_error += error * error;
    square_sigma += clock.offset_sigma_s() * clock.offset_sigma_s();
    ++n;
  }
  const double rms = std::sqrt(square_error / n);
  CHECK(rms < 0.5e-3);
  CHECK(rms < 3 * std::sqrt(square_sigma / n));
  CHECK(clock.offset_sigma_s() < 0.5e-3);
}

TEST_CASE("the tick goes on through its wrap") {
  Reader reader;
  reader.offset = static_cast<Utime>(Reader::wrap) * millisecond - 5 * second;
  ControllerClock clock(8 * millisecond, Reader::wrap);
  Utime truth = 0;
  reader.read(clock, truth);
  const Utime first = reader.last;
  int last_tick = 0;
  for (int i = 0; i < 1000; ++i) last_tick = reader.read(clock, truth);
  CHECK(last_tick < 10000);  // it has wrapped
  CHECK(seconds(reader.last - first) == Approx(10.0).margin(0.5));
  CHECK(std::abs(clock.host_time(reader.last) - truth) < millisecond);
}

TEST_CASE("bounds from before the controller's clock was set are forgotten") {
  Reader reader;
  ControllerClock clock(8 * millisecond, Reader::wrap);
  Utime truth = 0;
  for (int i = 0; i < 100; ++i) reader.read(clock, truth);
  reader.offset += 60 * millisecond;
  for (int i = 0; i < 100; ++i) reader.read(clock, truth);
  CHECK(std::abs(clock.host_time(reader.last) - truth) < millisecond);
}

}  // namespace
}  // namespace berth
