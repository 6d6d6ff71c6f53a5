// SPDX-License-Identifier: BSD-3-Clause
#include <berth/guidance_setpoint_t.hpp>
#include <berth/guidance_state_t.hpp>
#include <fstream>
#include <regex>

#include "common/core/file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/testbed/node/fake_cell.h"

namespace berth {
namespace {

using Catch::Matchers::Contains;

/// The testbed on the twin's bus, with a subscription to GUIDANCE_STATE, and an outside GNC that
/// publishes the same set-point ten times a second.
struct GuidedCell : FakeCell {
  explicit GuidedCell(const std::filesystem::path& config = "config") : FakeCell("range", config) {
    loop = &simulation.make_loop();
    bus = &simulation.make_bus();
    bus->subscribe<guidance_state_t>(channels::guidance_state, Queue::fifo(),
                                     [this](const guidance_state_t& m) { states.push_back(m); });
    loop->every(100 * millisecond, [this] {
      if (steers) publish_setpoint();
    });
    take_lease();
    REQUIRE(finished(send(move_to({0, 0, 4800, 0, 0, 0}, 0.3)), 60));
    estimator->silent = false;
    run_for(3.0);
  }
  void publish_setpoint() {
    guidance_setpoint_t message{};
    message.utime = now();
    message.seq = ++seq;
    message.session = setpoint_session;
    message.utime_expires = now() + lifetime;
    message.commander = by;
    Vector3d::Map(message.linear_velocity_m_s) = velocity;
    Vector3d::Map(message.angular_velocity_rad_s) = turning;
    bus->publish(channels::guidance_setpoint, message);
  }
  testbed_command2_t guided() {
    testbed_command2_t message = command(testbed_command2_t::GUIDED);
    message.speed_m_s = 0.05;
    message.angular_speed_rad_s = radians(2.0);
    message.guidance = "gnc";
    return message;
  }
  testbed_command2_t approach(const std::string& guidance) {
    testbed_command2_t message = command(testbed_command2_t::APPROACH);
    message.standoff_m = 3.8;
    message.dock = 1;
    message.speed_m_s = 0.05;
    message.angular_speed_rad_s = radians(5.0);
    message.guidance = guidance;
    return message;
  }
  /// Turns the model about an axis of its own frame, at rest at both ends.
  static void turn_target(testbed_command2_t& message, const Vector3d& by, double duration) {
    for (int i = 0; i <= 40; ++i) {
      const double x = i / 40.0;
      const Quaterniond q = rotation_from_vector(x * x * x * (10 - 15 * x + 6 * x * x) * by);
      waypoint_t waypoint{};
      waypoint.time_s = duration * x;
      set_pose({Vector3d::Zero(), q}, waypoint);
      message.waypoints.push_back(waypoint);
    }
    message.waypoint_count = static_cast<std::int32_t>(message.waypoints.size());
  }

  SimulatedLoop* loop = nullptr;
  SimulatedBus* bus = nullptr;
  std::vector<guidance_state_t> states;
  bool steers = false;
  std::string by = "gnc";
  std::int64_t setpoint_session = test_session;
  Utime lifetime = 500 * millisecond;
  Vector3d velocity = Vector3d::Zero();
  Vector3d turning = Vector3d::Zero();
  std::int64_t seq = 0;
};

TEST_CASE("an approach by a profile ends before the docking interface, reported at 10 Hz") {
  GuidedCell cell;
  const std::int64_t seq = cell.send(cell.approach("v_bar"));
  cell.run_for(5.0);
  CHECK(cell.state.refusal == "");
  CHECK(cell.state.state == testbed_state_t::CLOSED_LOOP);
  cell.states.clear();
  cell.run_for(2.0);
  CHECK(cell.states.size() == 20);
  CHECK(cell.states.back().law == "clohessy_wiltshire");
  CHECK(cell.states.back().profile == "v_bar");
  CHECK(cell.states.back().length_scale == 5);
  CHECK(cell.states.back().command_seq == seq);
  CHECK(cell.states.back().range_m > 3.8);
  CHECK(cell.states.back().corridor_limit_m > cell.states.back().corridor_offset_m);
  REQUIRE(cell.finished(seq, 120));
  CHECK(cell.states.back().phase == guidance_state_t::INACTIVE);
  cell.run_for(0.5);
  const Vector3d interface = cell.relative() * cell.cell.target.port()->pose.position;
  CHECK(distance({interface, {}}, {Vector3d(0, 0, 3.8), {}}) < 0.03);
}

TEST_CASE("a target that turns during the approach is followed; the arms deliver the sum") {
  GuidedCell cell;
  testbed_command2_t command = cell.approach("docking_axis");
  GuidedCell::turn_target(command, radians(25.0) * Vector3d(0.3, 1, 0.2).normalized(), 20);
  const std::int64_t seq = cell.send(command);
  cell.run_for(6.0);
  // at first only the estimate shows it
  const double seen = angle_between(cell.relative(), Pose{});
  CHECK(seen > radians(0.5));
  REQUIRE(cell.finished(seq, 120));
  cell.run_for(0.5);
  const Vector3d interface = cell.relative() * cell.cell.target.port()->pose.position;
  CHECK(distance({interface, {}}, {Vector3d(0, 0, 3.8), {}}) < 0.03);
  CHECK(degrees(angle_between(cell.relative(), Pose{})) < 1.0);

  SECTION("and the next command begins where it is") {
    const std::int64_t next = cell.send(cell.move_to({0, 0, 4800, 0, 0, 0}, 0.3));
    CHECK(cell.finished(next, 60));
  }
}

TEST_CASE("the testbed's own guidance, too, flies with a target that moves") {
  GuidedCell cell;
  testbed_command2_t command = cell.approach("");
  GuidedCell::turn_target(command, Vector3d(0, radians(6.0), 0), 10);
  const std::int64_t seq = cell.send(command);
  REQUIRE(cell.finished(seq, 120));
  CHECK(cell.states[5].law == "kinematic");
  CHECK(cell.states[5].range_m > 3.8);
}

TEST_CASE("what the arms cannot deliver is refused before anything moves") {
  GuidedCell cell;
  testbed_command2_t command = cell.approach("line_of_sight");
  GuidedCell::turn_target(command, Vector3d(0, radians(170.0), 0), 20);
  const std::int64_t seq = cell.send(command);
  cell.run_for(1.0);
  CHECK(cell.state.refused_seq == seq);
  CHECK_THAT(cell.state.refusal, Contains("arm"));
  const std::int64_t unknown = cell.send(cell.approach("no_such"));
  cell.run_for(1.0);
  CHECK(cell.state.refused_seq == unknown);
  CHECK_THAT(cell.state.refusal, Contains("v_bar"));
}

TEST_CASE("a lost estimate: held, then back, and the command has failed") {
  GuidedCell cell;
  const std::int64_t seq = cell.send(cell.approach("v_bar"));
  cell.run_for(10.0);
  cell.estimator->status = pose_estimate_t::LOST;
  cell.run_for(3.0);
  CHECK(cell.state.state == testbed_state_t::HOLDING);
  CHECK_THAT(cell.state.reason, Contains("lost"));
  const double held = cell.relative().position.z();
  REQUIRE(cell.run_until([&] { return cell.state.refused_seq == seq; }, 120));
  CHECK_THAT(cell.state.refusal, Contains("given up"));
  CHECK(cell.state.state == testbed_state_t::IDLE);
  CHECK(cell.events["retreat"] == 1);
  CHECK(cell.events["goes-on"] == 0);
  CHECK(cell.events["approach-aborted"] == 1);
  cell.run_for(0.5);
  CHECK(cell.relative().position.z() > held);
  const Pose rest = cell.relative();
  cell.run_for(1.0);
  CHECK(distance(rest, cell.relative()) < 1e-6);
}

TEST_CASE("a retreat that would lead beyond the arms' reach ends there, at rest") {
  const TemporaryDirectory directory;
  const std::filesystem::path config = directory / "config";
  std::filesystem::copy("config", config, std::filesystem::copy_options::recursive);
  const std::string law = GENERATE("v_bar", "docking_axis");
  const std::filesystem::path file = config / "guidance" / (law + ".yaml");
  std::string profile = std::regex_replace(read_file(file), std::regex("retreat_range: [^ ]+ m "),
                                           "retreat_range: 20 m ");
  profile = std::regex_replace(profile, std::regex("retreat_time: 60 s"), "retreat_time: 300 s");
  std::ofstream(file) << profile;
  GuidedCell cell(config);
  const std::int64_t seq = cell.send(cell.approach(law));
  cell.run_for(10.0);
  cell.estimator->status = pose_estimate_t::LOST;
  double fastest = 0;
  Pose before = cell.relative();
  REQUIRE(cell.run_until(
      [&] {
        cell.run_for(0.1);
        fastest = std::max(fastest, distance(before, cell.relative()) / 0.1);
        before = cell.relative();
        return cell.state.refused_seq == seq;
      },
      300));
  CHECK_THAT(cell.state.refusal, Contains("as far back as the arms reach"));
  CHECK_THAT(cell.state.refusal, Contains("lost"));
  CHECK(cell.events["approach-aborted"] == 1);
  CHECK(cell.events["motion-failed"] == 0);
  CHECK(cell.state.state == testbed_state_t::IDLE);
  CHECK(fastest > 0.03);
  cell.run_for(0.5);
  const Pose rest = cell.relative();
  CHECK(rest.position.z() > 5.5);  // it began at 4.8 m
  cell.run_for(1.0);
  CHECK(distance(rest, cell.relative()) < 1e-6);
  // and it is no dead end
  CHECK(cell.finished(cell.send(cell.move_to({0, 0, 4800, 0, 0, 0}, 0.3)), 60));
}

TEST_CASE("hold and resume stop the flight's time, the target's too") {
  GuidedCell cell;
  testbed_command2_t command = cell.approach("docking_axis");
  GuidedCell::turn_target(command, radians(20.0) * Vector3d::UnitY(), 20);
  const std::int64_t seq = cell.send(command);
  cell.run_for(8.0);
  cell.send(testbed_command2_t::HOLD);
  cell.run_for(3.0);
  CHECK(cell.state.state == testbed_state_t::HELD);
  const Pose held = cell.relative();
  cell.run_for(3.0);
  CHECK(distance(held, cell.relative()) < 1e-6);
  CHECK(angle_between(held, cell.relative()) < 1e-6);
  cell.send(testbed_command2_t::RESUME);
  REQUIRE(cell.finished(seq, 120));
}

TEST_CASE("an outside GNC steers by set-points, and only as long as they last") {
  GuidedCell cell;
  cell.velocity = Vector3d(0.01, 0, 0.03);
  const std::int64_t seq = cell.send(cell.guided());
  cell.run_for(2.0);
  CHECK(cell.state.command_seq == seq);
  CHECK(cell.state.state == testbed_state_t::HOLDING);
  CHECK_THAT(cell.state.reason, Contains("no set-point of 'gnc'"));
  const Pose before = cell.relative();
  cell.steers = true;
  cell.run_for(10.0);
  CHECK(cell.state.state == testbed_state_t::CLOSED_LOOP);
  CHECK(cell.states.back().phase == guidance_state_t::GUIDED);
  // the target comes nearer and goes to the left, as the chaser goes forward and to the right
  const Vector3d gone = cell.relative().position - before.position;
  CHECK(gone.z() == Approx(-0.28).margin(0.03));
  CHECK(gone.x() == Approx(-0.095).margin(0.015));

  SECTION("they stop: at rest within the braking time") {
    cell.steers = false;
    cell.run_for(2.5);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("expired"));
    const Pose rest = cell.relative();
    cell.run_for(1.0);
    CHECK(distance(rest, cell.relative()) < 1e-3);
  }
  SECTION("faster than the command allows: no faster than it allows") {
    cell.velocity = Vector3d(0, 0, 1);
    cell.run_for(2.0);
    const double from = cell.relative().position.z();
    cell.run_for(1.0);
    CHECK(from - cell.relative().position.z() == Approx(0.05).margin(0.003));
  }
  SECTION("a turn of the chaser turns the target the other way") {
    cell.velocity.setZero();
    cell.turning = Vector3d(0, radians(1.0), 0);
    cell.run_for(6.0);
    CHECK(rotation_vector(cell.relative().rotation).y() < radians(-3.5));
  }
  cell.send(testbed_command2_t::STOP);
  cell.run_for(3.0);
  CHECK(cell.state.state == testbed_state_t::IDLE);
}

TEST_CASE("set-points of another session, of another sender, or late ones move nothing") {
  GuidedCell cell;
  cell.velocity = Vector3d(0, 0, 0.05);
  cell.steers = true;
  SECTION("no outside GNC was requested") { cell.run_for(1.0); }
  SECTION("another session") {
    cell.setpoint_session = test_session - 1;
    cell.send(cell.guided());
  }
  SECTION("another sender") {
    cell.by = "somebody";
    cell.send(cell.guided());
  }
  SECTION("late") {
    cell.lifetime = -second;
    cell.send(cell.guided());
  }
  SECTION("the commander does not hold the lease") {
    testbed_command2_t command = cell.guided();
    command.commander = "gnc";
    cell.send(command);
  }
  cell.run_for(0.5);
  const Pose before = cell.relative();
  cell.run_for(4.0);
  CHECK(distance(before, cell.relative()) < 1e-5);
}

}  // namespace
}  // namespace berth
