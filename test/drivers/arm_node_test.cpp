// SPDX-License-Identifier: BSD-3-Clause
#include "test/catch.h"
#include "test/drivers/arm_bench.h"

namespace berth {
namespace {

TEST_CASE("the driver reports where the arm is, at 100 Hz") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(3 * second);
  REQUIRE(bench.states.size() > 250);
  const arm_state_t& state = bench.last();
  CHECK(state.valid);
  CHECK(state.state == arm_state_t::IDLE);
  CHECK(state.reason.empty());
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(state.reported_joint[i] == Approx(bench.placed.home[i]).margin(1e-6));
  }
  CHECK(state.cycle_s == Approx(0.01));
  CHECK(state.utime_received - state.utime_sent == 400);
  CHECK(state.reads_missed == 0);
}

TEST_CASE("set-points are followed after the dead time, and only after START") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(500 * millisecond);
  const Joints home = bench.placed.home;
  const auto path = [&](double t) {
    Joints joints = home;
    joints[0] += 0.1 * t;
    return joints;
  };
  bench.stream(0.5, path);
  CHECK(bench.saw("setpoint-without-start"));
  CHECK(bench.last().reported_joint[0] == Approx(home[0]).margin(1e-6));

  bench.send(arm_command_t::START);
  bench.simulation.run_for(50 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
  bench.stream(2, path);
  CHECK(bench.last().state == arm_state_t::RUNNING);
  CHECK(bench.last().setpoint_seq - bench.last().setpoint_seq_echoed <= 2);
  const double lag = 2 - (bench.last().reported_joint[0] - home[0]) / 0.1;
  CHECK(lag == Approx(0.17).margin(0.02));
}

}  // namespace
}  // namespace berth
