// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "procedures/language/trajectory.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::procedures;
using Catch::Matchers::Contains;

namespace {

Trajectory read(const std::string& rule, const std::string& file = "p.yaml") {
  Config step = Config::parse("trajectory: {" + rule + "}\n", file);
  return read_trajectory(step);
}

std::string refusal(const std::string& rule) {
  try {
    read(rule);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

const Pose here = pose_from_xyzwpr({100, 0, 5000, 5, 10, -5});

}  // namespace

TEST_CASE("a trajectory by rule begins where the replica is and ends as the rule has it") {
  const auto end_of = [](const std::string& rule) {
    const auto waypoints = read(rule).waypoints(here);
    CHECK(distance(waypoints.front().pose, here) < 1e-9);
    CHECK(angle_between(waypoints.front().pose, here) < 1e-7);
    return difference(here, waypoints.back().pose);
  };
  CHECK((end_of("straight: {by: [0, 0, -30, 0, 0, 0]}") -
         (Vector6d() << 0, 0, -0.03, 0, 0, 0).finished())
            .norm() < 1e-9);
  CHECK((end_of("fly_around: {angle: -20 deg, speed: 4 deg/s}") -
         (Vector6d() << 0, 0, 0, 0, -radians(20), 0).finished())
            .norm() < 1e-9);
  CHECK(end_of("v_bar: {to: 4 m, holds: [4.5 m], hold_for: 1 s}")[2] == Approx(-1));
  CHECK(end_of("r_bar: {to: 4500 mm, bulge: 30 mm}").head<3>().norm() == Approx(0.5));
  CHECK(end_of("oscillation: {amplitude: 100 mm, speed: 200 mm/s}").norm() < 1e-9);
  CHECK(end_of("spiral: {radius: 100 mm, turns: 2}").norm() == Approx(0.1));
  CHECK(end_of("drift: {duration: 20 s}").norm() < 0.2);
  CHECK(end_of("tumble: {inertia: [1, 2, 2.5], rate: [1 deg/s, 0 deg/s, 0 deg/s], duration: 9 s}")
            .tail<3>()
            .norm() == Approx(radians(9)).epsilon(1e-6));
}

TEST_CASE("how long a trajectory lasts is known where it does not depend on its beginning") {
  CHECK(read("waypoints: [{at: 0 s, pose: [0, 0, 5000, 0, 0, 0]}, "
             "{at: 7 s, pose: [0, 0, 4900, 0, 0, 0]}]")
            .duration == 7);
  CHECK(read("drift: {duration: 20 s, ramp: 3 s}").duration == Approx(23));
  CHECK(read("v_bar: {to: 4 m}").duration == 0);
}

TEST_CASE("a trajectory file stands next to its procedure") {
  const auto folder = std::filesystem::temp_directory_path() / "berth-trajectory-test";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "t.csv") << "t,x,y,z,w,p,r\n0,100,0,5000,5,10,-5\n5,100,0,4900,5,10,-5\n";
  const Trajectory found = read("file: {name: t.csv}", (folder / "p.yaml").string());
  CHECK(found.duration == Approx(7));
  CHECK(found.waypoints(here).back().pose.position.z() == Approx(4.9));
  std::filesystem::remove_all(folder);
  CHECK_THAT(refusal("file: {name: nowhere.csv}"), Contains("p.yaml:1") && Contains("nowhere.csv"));
}

TEST_CASE("an error in a trajectory names key, what was found and what was expected") {
  CHECK_THAT(refusal("loop: {}"), Contains("p.yaml:1") && Contains("loop") && Contains("spiral"));
  CHECK_THAT(refusal(""), Contains("expected one of") && Contains("fly_around"));
  CHECK_THAT(refusal("spiral: {radius: 1 m}, drift: {duration: 1 s}"), Contains("one rule"));
  CHECK_THAT(refusal("spiral: {radius: 1 m, spede: 1 m/s}"), Contains("spede"));
  CHECK_THAT(refusal("spiral: {}"), Contains("radius") && Contains("missing"));
  CHECK_THAT(refusal("straight: {by: [0, 0, 0, 0, 0, 0]}"), Contains("goes nowhere"));
  CHECK_THAT(refusal("fly_around: {angle: 10 deg, axis: [0, 0, 0]}"), Contains("axis"));
  CHECK_THAT(refusal("fly_around: {angle: 10 deg, speed: -1 deg/s}"), Contains("speed"));
  CHECK_THAT(refusal("oscillation: {amplitude: 1 m, speed: 1 m/s, cycles: 0}"), Contains("cycles"));
  CHECK_THAT(refusal("tumble: {inertia: [1, 1, 3], rate: [1 deg/s, 0 deg/s, 0 deg/s], "
                     "duration: 1 s}"),
             Contains("inertia") && Contains("other two"));
  CHECK_THAT(refusal("waypoints: []"), Contains("waypoints"));
}
