// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_cell.h"

#include <unistd.h>

#include <algorithm>
#include <berth/ground_truth_t.hpp>
#include <cmath>
#include <ctime>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <sstream>

#include "lcmtypes/channels.h"
#include "test/catch.h"
#include "test/drivers/simulated/cell_rig.h"

namespace berth {
namespace {

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

struct TemporaryDirectory {
  TemporaryDirectory()
      : path(std::filesystem::temp_directory_path() /
             ("berth-cell-test-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path);
  }
  ~TemporaryDirectory() { std::filesystem::remove_all(path); }
  std::filesystem::path path;
};

TEST_CASE("an unperturbed cell is where nominal kinematics of the reported joints put it") {
  for (const std::string layout : {"range", "contact", "free"}) {
    INFO(layout);
    Rig rig(layout);
    rig.move(1);
    rig.simulation.run_for(second);  // set-points have stopped: both arms are held
    CHECK(rig.arms[ArmRole::replica].state == arm_state_t::HELD);
    const Pose modelled =
        rig.nominal.relative_pose(rig.reported(ArmRole::replica), rig.reported(ArmRole::sensor));
    const Pose truth = rig.cell->true_relative_pose(rig.simulation.now());
    CHECK(distance(modelled, truth) < 2e-5);
    CHECK(angle_between(modelled, truth) < 1e-5);
    CHECK(distance(modelled, rig.nominal.relative_pose(rig.nominal.replica.home,
                                                       rig.nominal.sensor.home)) > 0.05);
  }
}

TEST_CASE("each kind of perturbation moves the truth by its size, and only the truth") {
  Rig exact("range");
  const Pose there = exact.cell->true_relative_pose(exact.simulation.now());
  const auto moved_by = [&](auto member, double size) {
    WorldSettings world;
    world.cell.*member = size;
    Rig rig("range", 3, world);
    CHECK(rig.reported(ArmRole::replica) == exact.reported(ArmRole::replica));
    const Pose pose = rig.cell->true_relative_pose(rig.simulation.now());
    CHECK(distance(there, rig.nominal.relative_pose(rig.nominal.replica.home,
                                                    rig.nominal.sensor.home)) < 2e-5);
    return distance(there, pose);
  };
  const double base = moved_by(&PerturbationSizes::base_position, 0.005);
  CHECK(base > 0.002);
  CHECK(base < 0.03);
  CHECK(moved_by(&PerturbationSizes::tool_position, 0.005) > 0.002);
  CHECK(moved_by(&PerturbationSizes::base_rotation, 0.01) > 0.005);
  CHECK(moved_by(&PerturbationSizes::link_position, 0.002) > 0.001);
  CHECK(moved_by(&PerturbationSizes::rotary_zero, 0.01) > 0.005);
  CHECK(moved_by(&PerturbationSizes::linear_zero, 0.01) < 1e-5);  // these arms have no linear axis
}

TEST_CASE("the same seed draws the same errors, another seed others") {
  WorldSettings departs;
  departs.cell.base_position = 0.005;
  const auto pose = [&](std::uint64_t seed) {
    Rig rig("contact", seed, departs);
    return rig.cell->true_relative_pose(rig.simulation.now());
  };
  const Pose first = pose(4);
  CHECK(distance(first, pose(4)) == 0);
  CHECK(distance(first, pose(5)) > 1e-4);
}

TEST_CASE("two runs of one seed give the same messages and the same truth, to the bit") {
  TemporaryDirectory directory;
  std::string logs[2];
  std::string truths[2];
  for (int i : {0, 1}) {
    WorldSettings departs;
    departs.cell.controller_clock = 1;
    departs.cell.controller_drift = 2e-5;
    {
      Rig rig("range", 8, departs, directory.path);
      rig.move(2);
      logs[i] = rig.log;
    }
    truths[i] = bytes_of(directory.path / "world_truth.lcm");
  }
  CHECK(logs[0].size() > 100000);
  CHECK((logs[0] == logs[1]));
  CHECK((truths[0] == truths[1]));
}

TEST_CASE("the world's truth is a stock log at 100 Hz, and none of it is on the bus") {
  TemporaryDirectory directory;
  Pose end;
  {
    Rig rig("range", 1, {}, directory.path);
    rig.move(1);
    end = rig.cell->true_relative_pose(rig.simulation.now());
    CHECK(rig.log.find(channels::world_truth) == std::string::npos);
    CHECK(rig.log.find(channels::ground_truth) == std::string::npos);
  }
  lcm::LogFile log((directory.path / "world_truth.lcm").string(), "r");
  REQUIRE(log.good());
  int n = 0;
  ground_truth_t truth{};
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    REQUIRE(event->channel == channels::world_truth);
    REQUIRE(truth.decode(event->data, 0, event->datalen) == event->datalen);
    REQUIRE(event->timestamp == truth.utime);
    ++n;
  }
  CHECK(n == 210);
  const Vector3d position(truth.position_m[0], truth.position_m[1], truth.position_m[2]);
  CHECK((position - end.position).norm() < 1e-9);
  // Each arm's flange is some 1.3 m from its axis and turns at 0.05 rad/s.
  const Vector3d velocity(truth.linear_velocity_m_s[0], truth.linear_velocity_m_s[1],
                          truth.linear_velocity_m_s[2]);
  CHECK(velocity.norm() > 0.1);
  CHECK(velocity.norm() < 0.5);
}

TEST_CASE("the world's draw is stored next to the run, and a tracker's view of it") {
  TemporaryDirectory directory;
  WorldSettings departs;
  departs.cell.base_position = 0.005;
  departs.scanner.range_bias = 0.005;
  {
    Rig rig("range", 4, departs, directory.path, true);
    rig.move(1);
  }
  const std::string world = bytes_of(directory.path / "world.yaml");
  CHECK(world.find("report_lag: 0.000 ms") != std::string::npos);
  CHECK(world.find("range: 0.000 mm") == std::string::npos);
  const std::string seen = bytes_of(directory.path / "tracker.csv");
  CHECK(seen.find("time,point,x,y,z\n") == 0);
  CHECK(std::count(seen.begin(), seen.end(), '\n') > 30);  // 20 Hz
  CHECK(seen.find(",S1,") != std::string::npos);
  CHECK(seen.find(",R4,") != std::string::npos);
}

TEST_CASE("an emergency stop at the PLC stops both arms") {
  Rig rig("range");
  rig.move(1);
  REQUIRE(rig.arms[ArmRole::sensor].state == arm_state_t::RUNNING);
  rig.cell->plc().press_estop(true);
  rig.simulation.run_for(30 * millisecond);
  CHECK(rig.arms[ArmRole::replica].state == arm_state_t::ESTOP);
  CHECK(rig.arms[ArmRole::sensor].state == arm_state_t::ESTOP);
  rig.simulation.run_for(200 * millisecond);
  const Pose rest = rig.cell->true_relative_pose(rig.simulation.now());
  rig.simulation.run_for(second);
  CHECK(distance(rest, rig.cell->true_relative_pose(rig.simulation.now())) == 0);
}

TEST_CASE("the LIDAR is served at its address") {
  Rig rig("range");
  int connected = 0;
  lidar::dial(
      rig.simulation.make_loop(), load_devices("config").lidar.address,
      [&](const std::unique_ptr<lidar::Connection>& connection, const std::string&) {
        connected += connection ? 1 : 0;
      },
      second);
  rig.simulation.run_for(10 * millisecond);
  CHECK(connected == 1);
}

TEST_CASE("what both arms at 100 Hz status and 60 Hz set-points cost", "[.benchmark]") {
  Rig rig("range");
  rig.recording = false;
  rig.move(1);
  const auto cpu = [] { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; };
  const double begin = cpu();
  constexpr double span = 60;
  const Utime start = rig.simulation.now();
  for (int i = 0; i < static_cast<int>(60 * span); ++i) {
    for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
      Joints joints = rig.nominal.arm(role).home;
      const double way = 0.05 * std::cos(0.1 * i / 60.0);
      joints[0] += role == ArmRole::replica ? way : -way;
      rig.command(role, arm_command_t::STREAM, joints);
    }
    rig.simulation.run_until(start + utime_from_seconds((i + 1) / 60.0));
  }
  const double used = cpu() - begin;
  WARN("CPU per simulated second: " << 1e3 * used / span << " ms; running: "
                                    << (rig.arms[ArmRole::sensor].state == arm_state_t::RUNNING));
}

}  // namespace
}  // namespace berth
