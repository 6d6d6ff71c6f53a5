// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/clock_map.h"

#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::lidar;

TEST_CASE("the tightest bracket wins, and says how sure it is") {
  ClockMap map;
  CHECK_FALSE(map.valid());
  map.add(1000, 501500, 2000);  // 1 ms wide: offset 500000
  CHECK(map.offset() == 500000);
  CHECK(map.sigma_s() == Approx(500e-6 / std::sqrt(3.0)));
  map.add(3000, 503110, 3200);  // 0.2 ms wide: offset 500010
  CHECK(map.offset() == 500010);
  map.add(5000, 506000, 9000);
  CHECK(map.offset() == 500010);
  CHECK(map.to_host(500110) == 100);
}

TEST_CASE("a bracket ages: a drifting clock is followed") {
  ClockMap map;
  Random random(1, "clock");
  double worst = 0;
  for (Utime t = 0; t < 120 * second; t += 250 * millisecond) {
    const auto clock = [](Utime at) { return at + 7 * second + at * 40 / 1000000; };  // 40 ppm
    const Utime there = 100 + static_cast<Utime>(random.uniform() * 400);
    const Utime back = 100 + static_cast<Utime>(random.uniform() * 400);
    map.add(t, clock(t + there), t + there + back);
    const double error = static_cast<double>(map.to_host(clock(t)) - t) * 1e-6;
    worst = std::max(worst, std::abs(error) / map.sigma_s());
    CHECK(std::abs(error) < 500e-6);
  }
  CHECK(worst < 1.7321);  // a bracket is a bound: sqrt(3) sigma
}

TEST_CASE("a device that starts anew is forgotten and learnt again") {
  ClockMap map;
  map.add(0, 100, 10);
  map.clear();
  CHECK_FALSE(map.valid());
  map.add(1000, 0, 1010);
  CHECK(map.offset() == -1005);
}
