// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <cmath>

#include "common/core/file.h"
#include "test/catch.h"
#include "test/drivers/arm/arm_bench.h"

namespace berth {
namespace {

/// A turn of joint 1 at this speed (rad/s), from home.
std::function<Joints(double)> turning(const ArmBench& bench, double speed) {
  return [home = bench.placed.home, speed](double t) {
    Joints joints = home;
    joints[0] += speed * t;
    return joints;
  };
}

TEST_CASE("the driver reports where the arm is, at 100 Hz") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(3 * second);
  REQUIRE(bench.states.size() > 280);
  const arm_state_t& state = bench.last();
  CHECK(state.valid);
  CHECK(state.state == arm_state_t::IDLE);
  CHECK(state.reason.empty());
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(state.reported_joint[i] == Approx(bench.placed.home[i]).margin(1e-6));
  }
  CHECK(state.cycle_s == Approx(0.0099).margin(2e-6));
  CHECK(state.utime_received - state.utime_sent == 400);
  CHECK(state.reads_missed == 0);
  CHECK(state.session == ArmBench::session);
  CHECK(state.program_state == 0);
}

TEST_CASE("linear axes go over the wire in mm") {
  ArmBench bench(ArmBench::default_options(), {}, "config/arms/gantry.yaml");
  bench.start_driver();
  bench.simulation.run_for(second);
  CHECK(bench.last().reported_joint[0] == Approx(0.1).margin(1e-6));
  CHECK(bench.last().reported_joint_sigma[0] == Approx(2e-5));
  CHECK(bench.last().reported_joint_sigma[3] == Approx(radians(0.002)));
  Word two[2];
  bench.controller->memory().read(27, two);
  CHECK(get_float(two) == Approx(100.0));
}

TEST_CASE("set-points are followed after the dead time, and only after START") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(500 * millisecond);
  bench.stream(0.5, turning(bench, 0.1));
  CHECK(bench.saw("setpoint-without-start"));
  CHECK(bench.last().reported_joint[0] == Approx(0.1).margin(1e-6));

  bench.send(arm_command_t::START);
  bench.simulation.run_for(50 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
  CHECK(bench.last().program_state == 2);
  bench.stream(2, turning(bench, 0.1));
  CHECK(bench.last().state == arm_state_t::RUNNING);
  CHECK(bench.last().setpoint_seq - bench.last().setpoint_seq_echoed <= 2);
  const double lag = 2 - (bench.last().reported_joint[0] - 0.1) / 0.1;
  CHECK(lag == Approx(0.17).margin(0.02));
  CHECK(bench.last().tcp_speed_m_s > 0.05);
  CHECK(bench.last().commanded_joint[0] > bench.last().reported_joint[0]);
}

TEST_CASE("a reported position carries the time at which it was true, whatever the clock's drift") {
  const double drift = GENERATE(0.0, 2e-5, -3e-4);
  CAPTURE(drift);
  ArmErrors errors;
  errors.clock = 12345 * millisecond;
  errors.drift = drift;
  ArmBench bench(ArmBench::default_options(), errors);
  bench.start_arm();
  constexpr double rate = 0.5;  // rad/s
  double worst = 0;
  double worst_rate = 0;
  int n = 0;
  arm_state_t last{};
  bench.bus->subscribe<arm_state_t>(
      channels::arm_state_replica, Queue::fifo(), [&](const arm_state_t& state) {
        if (!state.valid || state.state != arm_state_t::RUNNING || state.tcp_speed_m_s < 0.1)
          return;
        const auto true_joint = [&](Utime at) { return bench.controller->true_joints(at)[0]; };
        const double late = (state.reported_joint[0] - true_joint(state.utime)) / rate;
        // The offset is uniform within its bounds, sqrt(3) sigma. The simulated controller samples
        // on the host's grid and shows whole milliseconds: with drift it cuts off up to one.
        const double cut_off = drift == 0 ? 0 : 1e-3;
        const double bound = std::sqrt(3.0) * state.clock_offset_sigma_s + cut_off + 50e-6;
        worst = std::max(worst, std::abs(late) / bound);
        if (n > 0) {
          const double seemed = (state.reported_joint[0] - last.reported_joint[0]) /
                                seconds(state.utime - last.utime);
          const double was = (true_joint(state.utime) - true_joint(last.utime)) /
                             seconds(state.utime - last.utime);
          worst_rate = std::max(worst_rate, std::abs(seemed - was));
        }
        last = state;
        ++n;
      });
  bench.stream(3, turning(bench, rate));
  CHECK(n > 200);
  CHECK(worst < 1);
  CHECK(worst_rate < 0.1 * rate);
  const arm_state_t& state = bench.last();
  CHECK(state.clock_offset_sigma_s < 0.3e-3);  // on a tick of 8 ms
  const double started = seconds(Simulation::Options{}.start);
  CHECK(std::abs(state.clock_offset_s + started - 12.345) < 3e-3);
  for (std::size_t i = 1; i < bench.states.size(); ++i) {
    REQUIRE(bench.states[i].utime > bench.states[i - 1].utime);
  }
}

TEST_CASE("of commanded positions the servos' following error is in the reported sigma") {
  ArmBench bench;
  bench.following_lag = GENERATE(0.0, 0.025);
  bench.start_arm();
  const double resolution = load_devices("config").replica_arm.rotary_sigma;
  CHECK(bench.last().reported_joint_sigma[0] == resolution);
  const double speed = 0.2;  // rad/s
  const Joints home = bench.placed.home;
  bench.stream(2, [&](double t) {
    Joints joints = home;
    joints[0] += speed * t;
    return joints;
  });
  CHECK(bench.last().reported_joint_sigma[0] ==
        Approx(std::hypot(resolution, speed * bench.following_lag)).epsilon(0.03));
  CHECK(bench.last().reported_joint_sigma[1] == resolution);
  // At rest it dies away with the lag: a share of exp(-t / T).
  bench.send(arm_command_t::HOLD);
  bench.simulation.run_for(second);
  CHECK(bench.last().reported_joint_sigma[0] == Approx(resolution).epsilon(1e-6));
  CHECK(bench.saw("positions-commanded") == (bench.following_lag > 0));
}

TEST_CASE("HOLD stops the arm at once, and set-points after it move nothing until START") {
  ArmBench bench;
  bench.start_arm();
  const auto path = turning(bench, 0.5);
  bench.stream(1, path);
  const Utime ordered = bench.simulation.now();
  bench.send(arm_command_t::HOLD);
  REQUIRE(bench.simulation.run_until(
      [&] { return bench.controller->state() == ControllerState::held; }, ordered + second));
  CHECK(bench.simulation.now() - ordered < 5 * millisecond);
  bench.stream(1, turning(bench, 0.5));
  CHECK(bench.last().state == arm_state_t::HELD);
  const double rest = bench.last().reported_joint[0];
  bench.simulation.run_for(second);
  CHECK(bench.last().reported_joint[0] == rest);

  bench.send(arm_command_t::START);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
  bench.stream(1, [&](double t) {
    Joints joints = bench.placed.home;
    joints[0] = rest + 0.1 * t;
    return joints;
  });
  CHECK(bench.last().state == arm_state_t::RUNNING);
  CHECK(bench.last().reported_joint[0] > rest + 0.05);
}

TEST_CASE("HOLD does not wait behind a set-point that is under way") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  bench.send(arm_command_t::STREAM, turning(bench, 0.2)(0.5));
  bench.send(arm_command_t::HOLD);
  const Utime ordered = bench.simulation.now();
  REQUIRE(bench.simulation.run_until(
      [&] { return bench.controller->state() == ControllerState::held; }, ordered + second));
  CHECK(bench.simulation.now() - ordered < 5 * millisecond);
}

/// Connections of the controller's server: the driver dials for reads first.
constexpr int reads = 0;
constexpr int setpoints = 1;

/// ms from now until the controller holds; -1: not within a second.
double held_after(ArmBench& bench) {
  const Utime begin = bench.simulation.now();
  const bool held = bench.simulation.run_until(
      [&] { return bench.controller->state() == ControllerState::held; }, begin + second);
  return held ? 1e3 * seconds(bench.simulation.now() - begin) : -1;
}

TEST_CASE("an arm one of whose connections is lost in motion is held over the other, at once") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  SECTION("that for reads") { bench.controller->server().drop_connection(reads); }
  SECTION("that for set-points") { bench.controller->server().drop_connection(setpoints); }
  const double after = held_after(bench);
  CHECK(after >= 0);
  CHECK(after < 5);  // the controller's own watchdog takes 150 ms
  CHECK(bench.saw("arm-disconnected"));
  CHECK(bench.controller->error() == robot_error::none);
}

TEST_CASE("HOLD goes out over whichever connection is up") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  const int lost = GENERATE(reads, setpoints);
  SECTION("the other has been closed") { bench.controller->server().drop_connection(lost); }
  SECTION("the other hangs") { bench.controller->server().half_open(lost); }
  bench.send(arm_command_t::HOLD);
  const double after = held_after(bench);
  CHECK(after >= 0);
  CHECK(after < 75);  // a request that hangs is given up after 50 ms
  CHECK(bench.controller->error() == robot_error::none);
}

TEST_CASE("HOLD that finds no connection is written as soon as there is one") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  bench.controller->server().drop_connections();
  bench.simulation.run_for(millisecond);
  bench.send(arm_command_t::HOLD);
  // both are dialled again after 100 ms; the controller's own watchdog takes 150 ms
  const double after = held_after(bench);
  CHECK(after > 0);
  CHECK(after < 130);
}

TEST_CASE("a HOLD that a controller refuses is repeated until it takes it") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  bench.controller->server().faults().exception = 6;  // busy
  bench.send(arm_command_t::HOLD);
  bench.simulation.run_for(50 * millisecond);
  CHECK(bench.controller->state() == ControllerState::running);
  CHECK(bench.saw("hold-not-taken"));
  bench.controller->server().faults().exception = 0;
  const double after = held_after(bench);
  CHECK(after >= 0);
  CHECK(after < 20);
}

TEST_CASE("without its connection for set-points an arm is not started, and that is reported") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(500 * millisecond);
  bench.controller->server().half_open(setpoints);
  bench.simulation.run_for(100 * millisecond);
  CHECK_THAT(bench.text_of("arm-disconnected"), Catch::Contains("connection for set-points"));
  CHECK(bench.status.state == node_status_t::DEGRADED);
  bench.send(arm_command_t::START);
  bench.simulation.run_for(20 * millisecond);
  CHECK_THAT(bench.text_of("start-refused"), Catch::Contains("connection for set-points"));
  bench.simulation.run_for(second);  // dialled again
  CHECK(bench.status.state == node_status_t::READY);
}

TEST_CASE("a HOLD is obeyed whatever its session, age or order, and reported by name") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  arm_command_t hold{};
  hold.action = arm_command_t::HOLD;
  hold.seq = bench.seq + 100;
  hold.session = ArmBench::session;
  hold.utime = bench.simulation.now();
  hold.utime_expires = hold.utime + 100 * millisecond;
  std::string expected_text;
  SECTION("of another session") {
    hold.session = 76;
    expected_text = "belongs to session 76";
  }
  SECTION("expired") {
    hold.utime -= 24 * 3600 * second;
    hold.utime_expires -= 24 * 3600 * second;
    expected_text = "ms ago";
  }
  SECTION("overtaken by set-points") {
    hold.seq = 1;
    expected_text = "behind a later command";
  }
  SECTION("all of it, from a script that fills in nothing") {
    hold = {};
    hold.action = arm_command_t::HOLD;
    expected_text = "belongs to session 0 and expired";
  }
  bench.bus->publish(channels::arm_command_replica, hold);
  CHECK(held_after(bench) < 5);
  bench.simulation.run_for(20 * millisecond);
  CHECK_THAT(bench.text_of("unusual-stop"), Catch::Contains(expected_text));

  // The testbed answers a HOLD of another sender with its own before it starts again.
  if (hold.session != ArmBench::session) {
    bench.send(arm_command_t::START);
    bench.simulation.run_for(300 * millisecond);
    CHECK(bench.last().state == arm_state_t::HELD);
    CHECK(bench.saw("start-refused"));
    bench.send(arm_command_t::HOLD);
  }
  bench.seq = std::max(bench.seq, hold.seq);
  bench.send(arm_command_t::START);
  bench.simulation.run_for(300 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
  // What START has superseded is a repetition; the next one is none.
  bench.bus->publish(channels::arm_command_replica, hold);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
  ++hold.seq;
  bench.bus->publish(channels::arm_command_replica, hold);
  CHECK(held_after(bench) >= 0);
}

TEST_CASE("commands of another session, expired or overtaken ones move nothing") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(500 * millisecond);
  arm_command_t command{};
  command.utime = bench.simulation.now();
  command.utime_expires = command.utime + second;
  command.action = arm_command_t::START;
  command.seq = 1;
  command.session = ArmBench::session - 1;
  bench.bus->publish(channels::arm_command_replica, command);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.saw("command-of-another-session"));
  CHECK(bench.last().state == arm_state_t::IDLE);

  command.session = ArmBench::session;
  command.utime_expires = bench.simulation.now() - 1;
  bench.bus->publish(channels::arm_command_replica, command);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.saw("command-expired"));
  CHECK(bench.last().state == arm_state_t::IDLE);

  // HOLD, and behind it an older START that the network held back
  command.utime_expires = bench.simulation.now() + second;
  command.seq = 10;
  command.action = arm_command_t::HOLD;
  bench.bus->publish(channels::arm_command_replica, command);
  command.seq = 9;
  command.action = arm_command_t::START;
  bench.bus->publish(channels::arm_command_replica, command);
  bench.simulation.run_for(500 * millisecond);
  CHECK(bench.last().state == arm_state_t::IDLE);
  command.seq = 11;
  bench.bus->publish(channels::arm_command_replica, command);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
}

TEST_CASE("a first set-point far from the arm is refused and the arm held") {
  ArmBench bench;
  bench.start_arm();
  Joints far = bench.placed.home;
  far[3] += radians(1.1);
  bench.send(arm_command_t::STREAM, far);
  bench.simulation.run_for(200 * millisecond);
  CHECK_THAT(
      bench.text_of("setpoint-refused"),
      Catch::Contains("set-point of joint 4 is 1.10 deg away from the arm, allowed are 1.00"));
  CHECK(bench.last().state == arm_state_t::HELD);
  CHECK(bench.last().reported_joint[3] == Approx(bench.placed.home[3]).margin(1e-6));
}

TEST_CASE("a set-point farther than the joint can go since the last one is refused") {
  ArmBench bench;
  bench.start_arm();
  const auto path = turning(bench, 0.2);
  bench.stream(0.5, path);
  Joints far = path(0.5);
  far[0] += radians(10);
  bench.send(arm_command_t::STREAM, far);
  bench.simulation.run_for(300 * millisecond);
  CHECK_THAT(bench.text_of("setpoint-refused"), Catch::Contains("away from the last one"));
  CHECK(bench.last().state == arm_state_t::HELD);
  CHECK(bench.last().reported_joint[0] < path(0.6)[0]);

  Joints nowhere = bench.placed.home;
  nowhere[0] = std::nan("");
  bench.send(arm_command_t::START);
  bench.simulation.run_for(100 * millisecond);
  bench.send(arm_command_t::STREAM, nowhere);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.last().state == arm_state_t::HELD);
}

TEST_CASE("the driver holds the arm when set-points stop coming") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(1, turning(bench, 0.2));
  const Utime end = bench.simulation.now();
  REQUIRE(bench.simulation.run_until(
      [&] { return bench.controller->state() == ControllerState::held; }, end + second));
  CHECK(bench.simulation.now() - end < 140 * millisecond);  // they expire after 100 ms
  bench.simulation.run_for(10 * millisecond);
  CHECK(bench.saw("setpoints-stale"));
}

TEST_CASE("the controller holds the arm when the driver dies") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(1, turning(bench, 0.2));
  bench.node.reset();
  bench.simulation.run_for(170 * millisecond);
  CHECK(bench.controller->state() == ControllerState::held);
  CHECK(bench.controller->error() == robot_error::host_heartbeat);
}

TEST_CASE("joints that the controller does not vouch for are marked so") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(second);
  bench.controller->invalidate_joints(true);
  bench.simulation.run_for(50 * millisecond);
  CHECK_FALSE(bench.last().valid);
  CHECK_THAT(bench.last().reason, Catch::Contains("not valid"));
  bench.send(arm_command_t::START);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.saw("start-refused"));
  CHECK(bench.controller->state() == ControllerState::idle);
  bench.controller->invalidate_joints(false);
  bench.simulation.run_for(50 * millisecond);
  CHECK(bench.last().valid);
}

TEST_CASE("the joints of a controller whose tick stands still are marked invalid") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  bench.controller->freeze(true);
  bench.stream(0.3, [&](double t) { return turning(bench, 0.2)(t + 0.5); });
  CHECK_FALSE(bench.last().valid);
  CHECK(bench.last().state == arm_state_t::FAULT);
  CHECK_THAT(bench.last().reason, Catch::Contains("tick stands still"));
  CHECK(bench.saw("arm-stopped"));
  bench.controller->freeze(false);
  bench.simulation.run_for(500 * millisecond);
  CHECK(bench.last().valid);
  CHECK(bench.last().state != arm_state_t::RUNNING);
}

TEST_CASE("a controller that answers nothing is offline, and back when it answers") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(second);
  bench.controller->server().faults().silent = true;
  bench.simulation.run_for(300 * millisecond);
  CHECK(bench.last().state == arm_state_t::OFFLINE);
  CHECK_FALSE(bench.last().valid);
  CHECK(bench.last().reason == "no answer within 50 ms");
  CHECK(bench.saw("arm-disconnected"));
  bench.controller->server().faults().silent = false;
  bench.simulation.run_for(3 * second);
  CHECK(bench.last().state == arm_state_t::IDLE);
  CHECK(bench.last().valid);

  bench.controller->server().drop_connections();
  bench.simulation.run_for(20 * millisecond);
  CHECK(bench.last().state == arm_state_t::OFFLINE);
  bench.simulation.run_for(second);
  CHECK(bench.last().valid);
}

TEST_CASE("a controller that reboots in motion is seen, and does not move by itself") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(1, turning(bench, 0.2));
  bench.controller->reboot();
  bench.simulation.run_for(3 * second);
  CHECK(bench.saw("arm-disconnected"));
  CHECK(bench.last().state == arm_state_t::IDLE);
  CHECK(bench.last().valid);
  CHECK(bench.last().controller_time_us < 4 * second);
  bench.send(arm_command_t::START);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
}

TEST_CASE("after an emergency stop the arm needs RESET and START") {
  ArmBench bench;
  bench.start_arm();
  bench.stream(0.5, turning(bench, 0.2));
  bench.controller->set_safety(false, true);
  bench.simulation.run_for(50 * millisecond);
  CHECK(bench.last().state == arm_state_t::ESTOP);
  CHECK(bench.last().error_code == robot_error::emergency_stop);
  CHECK(bench.last().reason == "controller error 103: SRVO-001 Emergency stop");
  CHECK(bench.saw("arm-stopped"));
  bench.controller->set_safety(true, true);
  bench.simulation.run_for(50 * millisecond);
  CHECK(bench.last().state == arm_state_t::FAULT);
  bench.send(arm_command_t::START);
  bench.simulation.run_for(300 * millisecond);
  CHECK(bench.last().state == arm_state_t::FAULT);
  CHECK(bench.saw("start-refused"));
  bench.send(arm_command_t::RESET);
  bench.simulation.run_for(300 * millisecond);
  CHECK(bench.last().state == arm_state_t::IDLE);
  CHECK(bench.last().reason.empty());
  bench.send(arm_command_t::START);
  bench.simulation.run_for(100 * millisecond);
  CHECK(bench.last().state == arm_state_t::RUNNING);
}

TEST_CASE("an arm whose kinematics are not those of its controller is not started") {
  ArmBench bench;
  std::string text = read_file("config/arms/m710ic_50.yaml");
  text.replace(text.find("d6: 175 mm"), 10, "d6: 178 mm");
  const auto file = std::filesystem::temp_directory_path() /
                    ("berth-arm-" + std::to_string(::getpid()) + ".yaml");
  write_file(file, text);
  bench.start_driver("arm:502", ArmKinematics::load(file));
  std::filesystem::remove(file);
  bench.simulation.run_for(500 * millisecond);
  CHECK(bench.last().state == arm_state_t::IDLE);
  bench.send(arm_command_t::START);
  bench.simulation.run_for(300 * millisecond);
  CHECK_THAT(bench.text_of("start-refused"),
             Catch::Contains("mm, 3.0 mm away: the configured arm"));
  CHECK(bench.controller->state() == ControllerState::idle);
}

TEST_CASE("a driver without any answer yet reports the device it waits for") {
  ArmBench bench;
  bench.start_driver("nobody:502");
  bench.simulation.run_for(3 * second);
  CHECK(bench.status.state == node_status_t::STARTING);
  CHECK(bench.status.reason == "waiting for the controller at nobody:502");
}

TEST_CASE("a controller with another map is refused by name, until it is mended") {
  ArmBench bench;
  SnpxAssignment wrong = *bench.controller->memory().assignment(4);
  const SnpxAssignment right = wrong;
  wrong.variable = "PR[3]@27.19";
  bench.controller->memory().assign(wrong);
  bench.start_driver();
  bench.simulation.run_for(2 * second);
  CHECK(bench.text_of("arm-map-wrong") ==
        "replica arm: register map: $SNPX_ASG[4].$VAR_NAME is 'PR[3]@27.19', the map has "
        "'PR[1]@27.19'");
  CHECK(bench.last().state == arm_state_t::FAULT);
  CHECK_FALSE(bench.last().valid);
  bench.send(arm_command_t::START);
  bench.simulation.run_for(second);
  CHECK(bench.controller->state() == ControllerState::idle);
  bench.controller->memory().assign(right);
  bench.simulation.run_for(6 * second);
  CHECK(bench.last().state == arm_state_t::IDLE);
}

TEST_CASE("a controller that does not show its table is used, with a warning") {
  ArmBench bench;
  for (int slot = 76; slot <= 79; ++slot) {
    bench.controller->memory().assign({slot, 1, 0, "", 0});
  }
  bench.start_driver();
  bench.simulation.run_for(second);
  CHECK(bench.saw("arm-map-not-verified"));
  CHECK(bench.last().state == arm_state_t::IDLE);
  CHECK(bench.last().valid);
}

TEST_CASE("zero errors of the joints show in the truth, not in the report") {
  ArmErrors errors;
  errors.zero = {radians(0.5), 0, 0, 0, 0, 0};
  ArmBench bench(ArmBench::default_options(), errors);
  bench.start_driver();
  bench.simulation.run_for(second);
  const double reported = bench.last().reported_joint[0];
  CHECK(reported == Approx(bench.placed.home[0]).margin(1e-6));
  CHECK(bench.controller->true_joints(bench.simulation.now())[0] ==
        Approx(reported - radians(0.5)).margin(1e-6));
}

TEST_CASE("drift shows in the report, not in the truth; running away in both") {
  ArmBench bench;
  bench.start_driver();
  bench.simulation.run_for(second);
  bench.controller->drift({0.01, 0, 0, 0, 0, 0});
  bench.simulation.run_for(second);
  CHECK(bench.last().reported_joint[0] == Approx(0.11).margin(3e-4));
  CHECK(bench.controller->true_joints(bench.simulation.now())[0] == Approx(0.1));
  bench.controller->drift({});
  bench.controller->creep({0, 0.02, 0, 0, 0, 0});
  bench.simulation.run_for(second);
  CHECK(bench.controller->true_joints(bench.simulation.now())[1] == Approx(0.22).margin(1e-3));
  CHECK(bench.last().reported_joint[1] == Approx(0.22).margin(1e-3));
}

}  // namespace
}  // namespace berth
