// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/trajectories/recorded.h"

#include "common/core/error.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::testbed;
using Catch::Matchers::Contains;

namespace {

std::string refusal(const std::string& text, TrajectoryFile options = {}) {
  try {
    read_trajectory_text(text, "f.csv", options);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a trajectory file: columns by name, in any order, at its own times") {
  const Waypoints waypoints = read_trajectory_text(
      "# from the flight dynamics people\n"
      "t, z, y, x, w, p, r, note\r\n"
      "10, 5000, 20, 10, 1, 2, 3, here\n"
      "\n"
      "12.5, 4900, 20, 10, 1, 2, 4, there\n",
      "f.csv", {0});
  REQUIRE(waypoints.size() == 2);
  CHECK(waypoints[0].time == 0);
  CHECK(waypoints[1].time == 2.5);
  const Pose expected = pose_from_xyzwpr({10, 20, 4900, 1, 2, 4});
  CHECK(distance(waypoints[1].pose, expected) < 1e-12);
  CHECK(angle_between(waypoints[1].pose, expected) < 1e-7);
}

TEST_CASE("one that begins under way is brought from rest, on its own path") {
  std::string text = "t,x,y,z,w,p,r\n";
  for (int i = 0; i <= 200; ++i) {  // 100 mm/s from the first instant to the last
    text += std::to_string(0.1 * i) + ",0,0," + std::to_string(5000 - 10 * i) + ",0,0,0\n";
  }
  const Waypoints waypoints = read_trajectory_text(text, "f.csv", {});
  const WaypointPath path(waypoints);
  CHECK(path.duration() == Approx(22));
  CHECK(waypoints.front().pose.position.z() == Approx(5));
  CHECK(waypoints.back().pose.position.z() == Approx(3));
  CHECK(path.at(11.5).pose.position.z() - path.at(10.5).pose.position.z() == Approx(-0.1));
  constexpr double dt = 0.02;
  double before = 0;
  for (double t = 0; t < 22; t += dt) {
    const double speed = distance(path.at(t).pose, path.at(t + dt).pose) / dt;
    CHECK(std::abs(speed - before) / dt < 0.15);
    before = speed;
  }
}

TEST_CASE("an error in a trajectory file names line, what was found and what was expected") {
  const std::string head = "t,x,y,z,w,p,r\n0,0,0,5000,0,0,0\n";
  CHECK_THAT(refusal("a,b\n"), Contains("f.csv:1") && Contains("t,x,y,z,w,p,r"));
  CHECK_THAT(refusal("t,x,y,z,w,p\n"), Contains("'r' is missing"));
  CHECK_THAT(refusal(head + "1,0,zero,5000,0,0,0\n"),
             Contains("f.csv:3") && Contains("'zero' for y") && Contains("a number"));
  CHECK_THAT(refusal(head + "1,0,0\n"), Contains("f.csv:3") && Contains("for z"));
  CHECK_THAT(refusal(head + "1,nan,0,5000,0,0,0\n"), Contains("for x"));
  CHECK_THAT(refusal(head + "0,0,0,5000,0,0,0\n"), Contains("f.csv:3") && Contains("later"));
  CHECK_THAT(refusal(head + "1,0,0,5000,0,0,90\n"), Contains("90 deg"));
  CHECK_THAT(refusal(head), Contains("found 1 poses"));
  CHECK_THAT(refusal(""), Contains("found 0 poses"));
  std::string many = "t,x,y,z,w,p,r\n";
  for (int i = 0; i < 1000; ++i) many += std::to_string(i) + ",0,0,5000,0,0,0\n";
  CHECK_THAT(refusal(many, {0}), Contains("at most 900"));
  CHECK(refusal(many).empty());
}
