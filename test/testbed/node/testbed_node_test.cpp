// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/node/testbed_node.h"

#include "test/catch.h"
#include "test/testbed/node/fake_cell.h"

namespace berth {
namespace {

using Catch::Matchers::Contains;

const Xyzwpr start_pose{100, -100, 5500, 10, 8, -12};

TEST_CASE("a move brings the replica to the commanded pose, with both arms, and reports it") {
  FakeCell cell;
  REQUIRE(cell.state.state == testbed_state_t::IDLE);
  cell.take_lease();
  CHECK(cell.state.lease_holder == "test");
  const Joints replica_home = cell.replica->joints();
  const std::int64_t seq = cell.send(cell.move_to({100, -100, 4500, 10, 8, -12}));
  cell.run_for(1.0);
  CHECK(cell.state.command_seq == seq);
  CHECK(cell.state.state == testbed_state_t::MOVING);
  REQUIRE(cell.finished(seq, 60));
  cell.run_for(0.5);
  CHECK(cell.state.state == testbed_state_t::IDLE);
  const Pose goal = pose_from_xyzwpr({100, -100, 4500, 10, 8, -12});
  CHECK(distance(cell.relative(), goal) < 1e-6);
  CHECK(angle_between(cell.relative(), goal) < 1e-6);
  // each arm did its part of the metre
  const double by_sensor = distance(cell.cell.sensor.tool_pose(cell.cell.sensor.home),
                                    cell.cell.sensor.tool_pose(cell.sensor->joints()));
  CHECK(by_sensor == Approx(0.5).margin(0.02));
  CHECK(cell.replica->joints() != replica_home);
  CHECK(cell.state.clearance_m > 0.1);
  CHECK(cell.state.progress == 0);
}

TEST_CASE("what cannot be done is refused with where, when and which limit") {
  FakeCell cell;
  cell.take_lease();
  const auto refusal = [&](const testbed_command2_t& command) {
    const std::int64_t seq = cell.send(command);
    cell.run_for(0.2);
    CHECK(cell.state.refused_seq == seq);
    CHECK(cell.state.command_seq != seq);
    return cell.state.refusal;
  };
  CHECK_THAT(refusal(cell.move_to({0, 0, 9000, 0, 0, 0})),
             Contains("relative pose") && Contains("arm"));
  CHECK_THAT(refusal(cell.move_to({0, 1250, 5500, 0, 0, 90})), Contains("comes within"));
  CHECK_THAT(refusal(cell.move_to(start_pose, 2.0)), Contains("2000.0 mm/s"));
  testbed_command2_t broken = cell.move_to(start_pose);
  broken.q_wxyz[0] = std::nan("");
  CHECK_THAT(refusal(broken), Contains("not a pose"));
  CHECK_THAT(refusal(cell.command(testbed_command2_t::TRAJECTORY)), Contains("waypoint"));
  CHECK_THAT(refusal(cell.command(testbed_command2_t::RETREAT)), Contains("no way back"));
  CHECK_THAT(refusal(cell.command(testbed_command2_t::RESUME)), Contains("nothing is held"));
  CHECK_THAT(refusal(cell.command(99)), Contains("99"));
  testbed_command2_t approach = cell.command(testbed_command2_t::APPROACH);
  approach.standoff_m = 3.2;
  CHECK_THAT(refusal(approach), Contains("no estimate"));
  CHECK(cell.state.state == testbed_state_t::IDLE);
  CHECK(cell.replica->setpoints == 0);
}

TEST_CASE("a path that is only too fast is refused with the speed at which it passes") {
  FakeCell cell;
  cell.take_lease();
  testbed_command2_t trajectory = cell.command(testbed_command2_t::TRAJECTORY);
  waypoint_t waypoint{};
  waypoint.time_s = 0.3;
  waypoint.position_m[2] = 4.5;
  waypoint.q_wxyz[0] = 1;
  trajectory.waypoints = {waypoint};
  trajectory.waypoint_count = 1;
  const std::int64_t seq = cell.send(trajectory);
  cell.run_for(0.2);
  CHECK(cell.state.refused_seq == seq);
  CHECK_THAT(cell.state.refusal,
             Contains("deg/s") && Contains("it passes at") && Contains("% of the requested speed"));
}

TEST_CASE("hold brings the arms to rest on the path, resume goes on to the same end") {
  FakeCell cell;
  cell.take_lease();
  const Pose from = cell.relative();
  const Xyzwpr goal{0, 0, 4500, 0, 0, 0};
  const std::int64_t seq = cell.send(cell.move_to(goal));
  cell.run_for(5.0);
  const std::int64_t hold = cell.send(testbed_command2_t::HOLD);
  cell.run_for(1.5);
  CHECK(cell.state.command_seq == hold);
  CHECK(cell.state.state == testbed_state_t::HELD);
  const Pose held = cell.relative();
  cell.run_for(3.0);
  CHECK(distance(held, cell.relative()) < 1e-6);
  // on the line from start to goal
  const Vector3d line = (pose_from_xyzwpr(goal).position - from.position).normalized();
  CHECK((held.position - from.position).cross(line).norm() < 1e-5);
  CHECK(cell.replica->holds == 0);
  cell.send(testbed_command2_t::RESUME);
  REQUIRE(cell.finished(seq, 60));
  cell.run_for(0.5);
  CHECK(distance(cell.relative(), pose_from_xyzwpr(goal)) < 1e-6);
}

TEST_CASE("speed override changes the time and not the path") {
  FakeCell slow;
  slow.take_lease();
  slow.speed_override = 0.5;
  const testbed_command2_t move = slow.move_to({0, 0, 5000, 0, 0, 0});
  const Utime begun = slow.now();
  const std::int64_t seq = slow.send(move);
  REQUIRE(slow.finished(seq, 60));
  const double halved = seconds(slow.now() - begun);
  FakeCell full;
  full.take_lease();
  const Utime begun_full = full.now();
  REQUIRE(full.finished(full.send(full.move_to({0, 0, 5000, 0, 0, 0})), 60));
  const double whole = seconds(full.now() - begun_full);
  CHECK(halved > 1.6 * whole);
  CHECK(distance(slow.relative(), full.relative()) < 1e-3);
}

TEST_CASE("a controller's speed override slows the motion of both arms down, on its path") {
  FakeCell cell;
  cell.take_lease();
  const Pose from = cell.relative();
  const Xyzwpr goal{0, 0, 4500, 0, 0, 0};
  const std::int64_t seq = cell.send(cell.move_to(goal));
  cell.run_for(4.0);
  const auto speed = [&] { return Vector3d::Map(cell.state.commanded_velocity_m_s).norm(); };
  const double full = speed();
  cell.sensor->override = 0.5;
  cell.run_for(1.0);
  CHECK(speed() == Approx(0.5 * full).epsilon(0.02));
  CHECK(cell.state.speed_override == 1);  // the commander's
  CHECK(cell.events["controller-override"] == 1);
  const Vector3d line = (pose_from_xyzwpr(goal).position - from.position).normalized();
  CHECK((cell.relative().position - from.position).cross(line).norm() < 1e-5);
  cell.sensor->override = 1;
  REQUIRE(cell.finished(seq, 60));
}

TEST_CASE("the speed of a motion under way is changed smoothly, on its path, by its lease holder") {
  FakeCell cell;
  cell.take_lease();
  const Pose from = cell.relative();
  const Xyzwpr goal{0, 0, 4500, 0, 0, 0};
  const std::int64_t seq = cell.send(cell.move_to(goal));
  cell.run_for(4.0);
  const auto speed = [&] { return Vector3d::Map(cell.state.commanded_velocity_m_s).norm(); };
  const double full = speed();
  cell.keep_lease = false;
  testbed_command2_t keep = cell.command(testbed_command2_t::KEEP_LEASE);
  keep.commander = "somebody else";
  keep.speed_override = 0.1;
  cell.send(keep);
  cell.run_for(0.4);
  CHECK(cell.state.speed_override == 1);

  cell.keep_lease = true;
  cell.speed_override = 0.25;
  cell.send(testbed_command2_t::KEEP_LEASE);
  double fastest_change = 0;
  for (int i = 0; i < 20; ++i) {
    const double before = speed();
    cell.run_for(0.1);
    fastest_change = std::max(fastest_change, std::abs(speed() - before) / 0.1);
  }
  CHECK(cell.state.state == testbed_state_t::MOVING);
  CHECK(cell.state.speed_override == 0.25);
  CHECK(speed() == Approx(0.25 * full).epsilon(0.02));
  CHECK(fastest_change < 0.5);  // no step, but as gently as a hold
  const Vector3d line = (pose_from_xyzwpr(goal).position - from.position).normalized();
  CHECK((cell.relative().position - from.position).cross(line).norm() < 1e-5);

  SECTION("held, it stays held") {
    cell.send(testbed_command2_t::HOLD);
    cell.speed_override = 1;
    cell.run_for(2.0);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK(speed() < 1e-9);
    cell.send(testbed_command2_t::RESUME);
  }
  cell.speed_override = 1;
  REQUIRE(cell.finished(seq, 60));
  cell.run_for(0.5);
  CHECK(distance(cell.relative(), pose_from_xyzwpr(goal)) < 1e-6);
}

TEST_CASE("stop abandons a motion; retreat goes back along where it came from") {
  FakeCell cell;
  cell.take_lease();
  const Joints replica_home = cell.replica->joints();
  const std::int64_t seq = cell.send(cell.move_to({200, 100, 4800, 5, 5, 5}));
  cell.run_for(5.0);
  const std::int64_t stop = cell.send(testbed_command2_t::STOP);
  REQUIRE(cell.finished(stop, 3));
  CHECK(cell.state.state == testbed_state_t::IDLE);
  CHECK(cell.state.finished_seq != seq);
  cell.run_for(0.5);
  CHECK(distance(cell.relative(), pose_from_xyzwpr({200, 100, 4800, 5, 5, 5})) > 0.1);
  const std::int64_t retreat = cell.send(testbed_command2_t::RETREAT);
  REQUIRE(cell.finished(retreat, 60));
  cell.run_for(0.5);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(cell.replica->joints()[i] == Approx(replica_home[i]).margin(1e-6));
  }
}

TEST_CASE("while a motion is planned the testbed watches, and obeys HOLD and STOP") {
  FakeCell cell;
  cell.take_lease();
  const Xyzwpr goal{100, -100, 4500, 10, 8, -12};
  cell.simulation.stop_work(*cell.node_loop);
  const std::size_t truths = cell.truths.size();
  const std::int64_t seq = cell.send(cell.move_to(goal));
  cell.run_for(1.0);
  CHECK(cell.truths.size() > truths + 100);
  CHECK(cell.state.command_seq != seq);
  CHECK_THAT(cell.state.reason, Contains("is being planned"));

  SECTION("its answer comes with the plan, and it begins") {
    cell.simulation.go_on_with_work(*cell.node_loop);
    cell.run_for(0.2);
    CHECK(cell.state.command_seq == seq);
    REQUIRE(cell.finished(seq, 60));
  }
  SECTION("a second command is refused") {
    const std::int64_t other = cell.send(cell.move_to(goal));
    cell.run_for(0.2);
    CHECK(cell.state.refused_seq == other);
    CHECK_THAT(cell.state.refusal, Contains("is still being planned"));
  }
  SECTION("a hold holds it at its start") {
    const std::int64_t hold = cell.send(testbed_command2_t::HOLD);
    cell.run_for(0.2);
    CHECK(cell.state.command_seq == hold);
    cell.simulation.go_on_with_work(*cell.node_loop);
    const Pose before = cell.relative();
    cell.run_for(3.0);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK(distance(cell.relative(), before) < 1e-9);
    cell.send(testbed_command2_t::RESUME);
    REQUIRE(cell.finished(seq, 60));
  }
  SECTION("a stop abandons it, whatever comes of the plan") {
    const std::int64_t stop = cell.send(testbed_command2_t::STOP);
    cell.run_for(0.2);
    CHECK(cell.state.finished_seq == stop);
    CHECK(cell.state.refused_seq == seq);
    CHECK_THAT(cell.state.refusal, Contains("stopped by 'test'"));
    cell.simulation.go_on_with_work(*cell.node_loop);
    cell.run_for(3.0);
    CHECK(cell.state.state == testbed_state_t::IDLE);
    CHECK(cell.replica->starts == 0);
  }
  SECTION("it does not begin once the lease is lost, the stop pressed or an arm moved") {
    const auto what = GENERATE(0, 1, 2);
    if (what == 0) cell.keep_lease = false;
    if (what == 1) cell.facility->estop_closed = false;
    if (what == 2) cell.replica->jump = 0.01;
    cell.run_for(3.0);
    cell.simulation.go_on_with_work(*cell.node_loop);
    cell.run_for(1.0);
    CHECK(cell.state.refused_seq == seq);
    CHECK(cell.replica->starts == 0);
    INFO(cell.state.refusal);
    CHECK_THAT(cell.state.refusal, Contains(what == 0   ? "the lease was lost"
                                            : what == 1 ? "stop is pressed"
                                                        : "moved"));
  }
  SECTION("beyond its budget the testbed is in FAULT until it ends") {
    cell.run_for(19.2);
    CHECK(cell.status.state == node_status_t::FAULT);
    CHECK_THAT(cell.status.reason, Contains("planning command") && Contains("budget of 20.0 s"));
    cell.simulation.go_on_with_work(*cell.node_loop);
    cell.run_for(0.2);
    CHECK(cell.status.state == node_status_t::RUNNING);
  }
}

TEST_CASE("a trajectory goes through its waypoints at their times") {
  FakeCell cell;
  cell.take_lease();
  testbed_command2_t trajectory = cell.command(testbed_command2_t::TRAJECTORY);
  const std::vector<Xyzwpr> poses{
      {0, 0, 5300, 0, 5, 0}, {100, 0, 5100, 5, 5, 10}, {100, 50, 5000, 0, 0, 0}};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    waypoint_t waypoint{};
    waypoint.time_s = 5.0 * static_cast<double>(i + 1);
    set_pose(pose_from_xyzwpr(poses[i]), waypoint);
    trajectory.waypoints.push_back(waypoint);
  }
  trajectory.waypoint_count = 3;
  const std::int64_t seq = cell.send(trajectory);
  std::vector<double> nearest(poses.size(), 1e9);
  REQUIRE(cell.run_until(
      [&] {
        for (std::size_t i = 0; i < poses.size(); ++i) {
          nearest[i] = std::min(nearest[i], distance(cell.relative(), pose_from_xyzwpr(poses[i])));
        }
        return cell.state.finished_seq == seq;
      },
      30));
  cell.run_for(0.5);
  CHECK(nearest[0] < 2e-3);
  CHECK(nearest[1] < 2e-3);
  CHECK(distance(cell.relative(), pose_from_xyzwpr(poses[2])) < 1e-6);
}

TEST_CASE("an approach by the estimate alone ends at the standoff, whatever the nominal bias") {
  FakeCell cell;
  cell.take_lease();
  REQUIRE(cell.finished(cell.send(cell.move_to(start_pose)), 30));
  // the world is as estimated: 8 mm and 0.2 degrees from nominal, constant
  cell.estimator->offset << 0.005, -0.004, 0.006, 0.002, -0.002, 0.003;
  cell.estimator->silent = false;
  cell.run_for(3.0);
  testbed_command2_t approach = cell.command(testbed_command2_t::APPROACH);
  approach.standoff_m = 4.5;
  approach.speed_m_s = 0.04;
  const std::int64_t seq = cell.send(approach);
  cell.run_for(5.0);
  CHECK(cell.state.state == testbed_state_t::CLOSED_LOOP);
  CHECK(cell.state.progress > 0.05);
  CHECK(cell.state.commanded_velocity_m_s[2] == Approx(-0.04).margin(0.005));
  REQUIRE(cell.finished(seq, 120));
  cell.run_for(1.0);
  // by what the estimator sees
  const Pose seen = perturbed(cell.relative(), cell.estimator->offset);
  const Vector3d eye = seen.inverse().position;
  const double reached = (RayCaster(cell.cell.target.mesh).nearest(eye) - eye).norm();
  CHECK(reached == Approx(4.5).margin(0.01));
  // attitude and sideways offset as at the start
  const Pose start = perturbed(pose_from_xyzwpr(start_pose), cell.estimator->offset);
  CHECK(std::abs(seen.position.x() - start.position.x()) < 0.01);
  CHECK(std::abs(seen.position.y() - start.position.y()) < 0.01);
  CHECK(degrees(angle_between(seen, start)) < 0.5);
}

TEST_CASE("an estimate that drifts from the commanded pose is followed") {
  FakeCell cell;
  cell.take_lease();
  REQUIRE(cell.finished(cell.send(cell.move_to({0, 0, 5500, 0, 0, 0})), 30));
  cell.estimator->silent = false;
  cell.run_for(3.0);
  testbed_command2_t keep = cell.move_to({0, 0, 5500, 0, 0, 0});
  keep.command = testbed_command2_t::STATION_KEEP;
  cell.send(keep);
  cell.run_for(3.0);
  cell.estimator->offset << 0.05, 0, -0.03, 0, 0, 0;
  cell.run_for(40.0);
  CHECK(cell.state.state == testbed_state_t::CLOSED_LOOP);
  // the arms have worked the difference off
  CHECK(cell.relative().position.x() == Approx(-0.05).margin(0.006));
  CHECK(cell.relative().position.z() == Approx(5.53).margin(0.006));
  const std::int64_t stop = cell.send(testbed_command2_t::STOP);
  CHECK(cell.finished(stop, 3));
}

TEST_CASE("a stale or lost estimate holds the approach; good ones let it go on") {
  FakeCell cell;
  cell.take_lease();
  REQUIRE(cell.finished(cell.send(cell.move_to(start_pose)), 30));
  cell.estimator->silent = false;
  cell.run_for(3.0);
  testbed_command2_t approach = cell.command(testbed_command2_t::APPROACH);
  approach.standoff_m = 4.8;
  approach.speed_m_s = 0.04;
  const std::int64_t seq = cell.send(approach);
  cell.run_for(4.0);
  REQUIRE(cell.state.state == testbed_state_t::CLOSED_LOOP);

  SECTION("silent: held within its limit of age, and given up in the end") {
    cell.estimator->silent = true;
    cell.run_for(5.0);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("s old"));
    const Pose held = cell.relative();
    cell.run_for(5.0);
    CHECK(distance(held, cell.relative()) < 1e-6);
    cell.run_for(26.0);
    CHECK(cell.state.state == testbed_state_t::HELD);
    cell.estimator->silent = false;
    cell.run_for(5.0);
    CHECK(cell.state.state == testbed_state_t::HELD);  // it needs a person's command
    cell.send(testbed_command2_t::RESUME);
    REQUIRE(cell.finished(seq, 60));
  }
  SECTION("lost: held at once") {
    cell.estimator->status = pose_estimate_t::LOST;
    cell.run_for(2.5);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("lost"));
    cell.estimator->status = pose_estimate_t::OK;
    REQUIRE(cell.finished(seq, 60));
    CHECK(cell.surface_distance() == Approx(4.8).margin(0.01));
  }
  SECTION("certain without a covariance: held at once") {
    cell.estimator->variance = GENERATE(std::numeric_limits<double>::quiet_NaN(), 0.0, -1e-6);
    cell.run_for(2.5);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("its covariance is not"));
  }
  SECTION("ambiguous: held at once") {
    cell.estimator->status = pose_estimate_t::AMBIGUOUS;
    cell.run_for(2.5);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("ambiguous"));
  }
  SECTION("confidently wrong by half a metre: truth contradicts, and so long nothing goes on") {
    cell.estimator->offset << 0, 0, 0.5, 0, 0, 0;
    const Pose before = cell.relative();
    cell.run_for(10.0);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK(cell.events["estimate-wrong"] == 1);
    CHECK_THAT(cell.state.reason, Contains("away from ground truth"));
    CHECK(distance(before, cell.relative()) < 0.06);  // the way until the estimate came
    cell.send(testbed_command2_t::RESUME);
    cell.run_for(1.0);
    CHECK_THAT(cell.state.refusal, Contains("away from ground truth"));
    cell.estimator->offset.setZero();
    cell.run_for(3.0);
    CHECK(cell.state.state == testbed_state_t::HELD);
    cell.send(testbed_command2_t::RESUME);
    cell.run_for(3.0);
    CHECK(cell.state.state == testbed_state_t::CLOSED_LOOP);
  }
  SECTION("the LIDAR's driver dies: both arms stop at once") {
    cell.lidar.reset();
    const Utime died = cell.now();
    cell.run_for(0.5);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("lidar-driver"));
    CHECK(cell.replica->last_hold - died < 200 * millisecond);
    CHECK(cell.replica->last_hold > died);
  }
}

TEST_CASE("only the holder of the lease moves the arms") {
  FakeCell cell;
  SECTION("not held") {
    const std::int64_t seq = cell.send(cell.move_to(start_pose));
    cell.run_for(0.5);
    CHECK(cell.state.refused_seq == seq);
    CHECK_THAT(cell.state.refusal, Contains("lease"));
  }
  SECTION("held by another") {
    cell.take_lease();
    testbed_command2_t other = cell.move_to(start_pose);
    other.commander = "other";
    cell.send(other);
    cell.run_for(0.5);
    CHECK_THAT(cell.state.refusal, Contains("'test'"));
    testbed_command2_t take = cell.command(testbed_command2_t::TAKE_LEASE);
    take.commander = "other";
    cell.send(take);
    cell.run_for(0.5);
    CHECK(cell.state.refused_seq == take.seq);
    CHECK(cell.state.lease_holder == "test");
    CHECK(cell.replica->setpoints == 0);
    // but every commander may stop them
    const std::int64_t move = cell.send(cell.move_to({0, 0, 5000, 0, 0, 0}));
    cell.run_for(2.0);
    CHECK(cell.state.command_seq == move);
    testbed_command2_t hold = cell.command(testbed_command2_t::HOLD);
    hold.commander = "other";
    cell.send(hold);
    cell.run_for(2.0);
    CHECK(cell.state.state == testbed_state_t::HELD);
  }
  SECTION("a silent holder loses it, and the arms come to rest on the path") {
    cell.take_lease();
    cell.send(cell.move_to({0, 0, 4500, 0, 0, 0}));
    cell.run_for(3.0);
    cell.keep_lease = false;
    cell.run_for(4.0);
    CHECK(cell.state.lease_holder.empty());
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK(cell.events["lease-lapsed"] == 1);
    const Pose held = cell.relative();
    cell.run_for(1.0);
    CHECK(distance(held, cell.relative()) < 1e-6);
  }
  SECTION("released: the controllers stand by themselves") {
    cell.take_lease();
    REQUIRE(cell.finished(cell.send(cell.move_to({0, 0, 5400, 0, 0, 0})), 30));
    cell.keep_lease = false;
    cell.send(testbed_command2_t::RELEASE_LEASE);
    cell.run_for(0.5);
    CHECK(cell.state.lease_holder.empty());
    CHECK(cell.replica->state == arm_state_t::HELD);
  }
}

TEST_CASE("HOLD and STOP are obeyed whatever their session, age or order, and reported by name") {
  FakeCell cell;
  cell.take_lease();
  const std::int64_t move = cell.send(cell.move_to({0, 0, 4500, 0, 0, 0}));
  cell.run_for(3.0);
  const bool holds = GENERATE(true, false);
  testbed_command2_t stop =
      cell.command(holds ? testbed_command2_t::HOLD : testbed_command2_t::STOP);
  stop.commander = "somebody";
  std::string commander = "somebody";
  SECTION("of another session") { stop.session = test_session - 1; }
  SECTION("late") { stop.utime_expires = cell.now() - 3600 * second; }
  SECTION("overtaken by a later command of its sender") {
    stop.commander = "test";
    stop.seq = move - 1;
    stop.utime = 0;
  }
  SECTION("from a script that fills in nothing") {
    stop = {};
    stop.command = holds ? testbed_command2_t::HOLD : testbed_command2_t::STOP;
  }
  cell.send(stop);
  cell.run_for(1.5);
  CHECK(cell.state.state == (holds ? testbed_state_t::HELD : testbed_state_t::IDLE));
  CHECK(cell.events["unusual-stop"] == 1);
  const Pose rest = cell.relative();
  cell.run_for(1.0);
  CHECK(distance(rest, cell.relative()) < 1e-6);

  // what goes on does not stop for a repetition, but for the next one
  if (holds) {
    cell.send(testbed_command2_t::RESUME);
  } else {
    cell.send(cell.move_to({0, 0, 4500, 0, 0, 0}));
  }
  cell.run_for(0.5);
  cell.send(stop);
  cell.run_for(0.5);
  CHECK(cell.state.state == testbed_state_t::MOVING);
  ++stop.seq;
  cell.send(stop);
  cell.run_for(1.5);
  CHECK(cell.state.state == (holds ? testbed_state_t::HELD : testbed_state_t::IDLE));
}

TEST_CASE("arms that do not stand are commanded to hold until they do") {
  FakeCell cell;
  cell.take_lease();
  cell.send(cell.move_to({0, 0, 4500, 0, 0, 0}));
  cell.run_for(3.0);
  cell.replica->unresponsive = true;
  cell.facility->estop_closed = false;
  cell.facility->publish_now();
  cell.run_for(6.0);
  CHECK(cell.sensor->state == arm_state_t::HELD);
  CHECK(cell.replica->state == arm_state_t::RUNNING);
  cell.replica->unresponsive = false;
  cell.run_for(0.1);
  CHECK(cell.replica->state == arm_state_t::HELD);
  const int holds = cell.replica->holds;
  cell.run_for(1.0);
  CHECK(cell.replica->holds == holds);
}

TEST_CASE("a hold is obeyed on the way back to the path, and before a retreat") {
  FakeCell cell;
  cell.take_lease();
  const std::int64_t move = cell.send(cell.move_to({0, 0, 4500, 0, 0, 0}));
  cell.run_for(5.0);
  SECTION("on the way back to the path") {
    cell.replica->silent = true;
    cell.run_for(1.0);
    cell.replica->silent = false;
    const int starts = cell.replica->starts;
    REQUIRE(cell.run_until([&] { return cell.replica->starts > starts; }, 5));
    REQUIRE(cell.run_until([&] { return cell.replica->state == arm_state_t::RUNNING; }, 5));
    cell.run_for(0.05);
    cell.send(testbed_command2_t::HOLD);
    cell.run_for(0.5);
    CHECK(cell.state.state == testbed_state_t::HELD);
    const Pose held = cell.relative();
    cell.run_for(3.0);
    CHECK(distance(held, cell.relative()) < 1e-6);
    cell.send(testbed_command2_t::RESUME);
    CHECK(cell.finished(move, 60));
  }
  SECTION("before a retreat") {
    const std::int64_t retreat = cell.send(testbed_command2_t::RETREAT);
    cell.run_for(0.1);
    cell.send(testbed_command2_t::HOLD);
    cell.run_for(2.0);
    CHECK(cell.state.state == testbed_state_t::HELD);
    const Pose held = cell.relative();
    cell.run_for(2.0);
    CHECK(distance(held, cell.relative()) < 1e-6);
    cell.send(testbed_command2_t::RESUME);
    CHECK(cell.finished(retreat, 60));
  }
}

TEST_CASE("commands of another session and late ones move nothing; a repeated one moves once") {
  FakeCell cell;
  cell.take_lease();
  testbed_command2_t old = cell.move_to(start_pose);
  old.session = test_session - 1;
  cell.send(old);
  cell.run_for(1.0);
  CHECK(cell.events["command-of-another-session"] == 1);
  testbed_command2_t late = cell.move_to(start_pose);
  late.utime_expires = cell.now() - second;
  cell.send(late);
  cell.run_for(1.0);
  CHECK(cell.events["command-expired"] == 1);
  CHECK(cell.replica->setpoints == 0);
  CHECK(cell.state.command_seq == 0);
  CHECK(cell.state.refused_seq == 0);

  const testbed_command2_t move = cell.move_to({0, 0, 5400, 0, 0, 0});
  cell.send(move);
  REQUIRE(cell.finished(move.seq, 30));
  const int begun = cell.events["motion-begins"];
  cell.send(move);
  cell.run_for(1.0);
  CHECK(cell.events["motion-begins"] == begun);
  CHECK(cell.state.state == testbed_state_t::IDLE);
}

TEST_CASE("a motion that comes for the first time behind a later command is refused") {
  FakeCell cell;
  cell.take_lease();
  const testbed_command2_t lost = cell.move_to({100, -100, 4500, 10, 8, -12});
  cell.send(testbed_command2_t::HOLD);
  cell.run_for(0.2);
  cell.send(lost);  // its first datagram did not arrive
  cell.run_for(0.2);
  CHECK(cell.state.refused_seq == lost.seq);
  CHECK_THAT(cell.state.refusal, Contains("comes behind command"));
  CHECK(cell.state.state == testbed_state_t::IDLE);
}

TEST_CASE("faults stop the arms at once, and report what it takes to go on") {
  FakeCell cell;
  cell.take_lease();
  const std::int64_t seq = cell.send(cell.move_to({0, 0, 4500, 0, 0, 0}));
  cell.run_for(4.0);
  REQUIRE(cell.state.state == testbed_state_t::MOVING);
  const auto goes_on_after_resume = [&] {
    cell.send(testbed_command2_t::RESUME);
    const bool done = cell.finished(seq, 60);
    cell.run_for(0.5);
    return done && distance(cell.relative(), pose_from_xyzwpr({0, 0, 4500, 0, 0, 0})) < 1e-6;
  };

  SECTION("emergency stop") {
    cell.facility->estop_closed = false;
    const Utime pressed = cell.now();
    cell.facility->publish_now();
    cell.run_for(0.3);
    CHECK(cell.replica->holds == 1);
    CHECK(cell.sensor->holds == 1);
    CHECK(cell.replica->last_hold - pressed < 50 * millisecond);
    CHECK(cell.state.state == testbed_state_t::FAULT);
    CHECK_THAT(cell.state.reason, Contains("emergency stop"));
    cell.send(testbed_command2_t::RESUME);
    cell.run_for(0.5);
    CHECK_THAT(cell.state.refusal, Contains("emergency stop"));
    const std::int64_t reset = cell.send(testbed_command2_t::RESET);
    cell.run_for(0.5);
    CHECK(cell.state.refused_seq == reset);
    cell.facility->estop_closed = true;
    cell.run_for(0.5);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK(goes_on_after_resume());
  }
  SECTION("fence") {
    cell.facility->fence_closed = false;
    cell.run_for(0.5);
    CHECK(cell.state.state == testbed_state_t::FAULT);
    CHECK_THAT(cell.state.reason, Contains("fence"));
  }
  SECTION("one controller faults: the other arm stops too; after a reset it goes on") {
    cell.sensor->state = arm_state_t::FAULT;
    cell.run_for(0.3);
    CHECK(cell.replica->state == arm_state_t::HELD);
    CHECK(cell.state.state == testbed_state_t::FAULT);
    CHECK_THAT(cell.state.reason, Contains("sensor arm"));
    cell.send(testbed_command2_t::RESUME);
    cell.run_for(0.2);
    CHECK_THAT(cell.state.refusal, Contains("sensor arm's controller has a fault"));
    const std::int64_t reset = cell.send(testbed_command2_t::RESET);
    cell.run_for(0.5);
    CHECK(cell.state.command_seq == reset);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK(goes_on_after_resume());
  }
  SECTION("a controller stops by itself") {
    cell.replica->state = arm_state_t::HELD;
    cell.run_for(0.3);
    CHECK(cell.sensor->state == arm_state_t::HELD);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK_THAT(cell.state.reason, Contains("replica arm stopped by itself"));
    CHECK(goes_on_after_resume());
  }
  SECTION("an arm falls silent for a while: both stop at once, then go on by themselves") {
    cell.replica->silent = true;
    const Utime silent_since = cell.now();
    cell.run_for(0.35);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("replica arm"));
    CHECK(cell.sensor->holds == 1);
    CHECK(cell.sensor->last_hold - silent_since < 180 * millisecond);
    cell.run_for(1.5);
    CHECK(cell.replica->holds > 1);  // as far as is known it still moves
    cell.replica->silent = false;
    cell.run_for(1.5);
    INFO(cell.state.reason);
    CHECK(cell.state.state == testbed_state_t::MOVING);
    CHECK(cell.finished(seq, 60));
  }
  SECTION("joints that are not valid count as silence") {
    cell.sensor->valid = false;
    cell.run_for(0.35);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
  }
  SECTION("a driver dies: its heartbeat is missed") {
    cell.facility.reset();
    cell.run_for(0.35);
    CHECK(cell.state.state == testbed_state_t::HOLDING);
    CHECK_THAT(cell.state.reason, Contains("heartbeat of facility-driver"));
  }
  SECTION("a controller starts anew: a person has to look") {
    cell.sensor->controller_time = 3600 * second;
    cell.run_for(0.1);
    cell.sensor->controller_time = 0;
    cell.run_for(0.1);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK_THAT(cell.state.reason, Contains("sensor arm's controller was started anew"));
    CHECK(cell.replica->holds == 1);
    CHECK(goes_on_after_resume());
  }
  SECTION("joints that no motor could reach so soon") {
    cell.replica->jump = 0.2;
    cell.run_for(0.1);
    CHECK(cell.state.state == testbed_state_t::HELD);
    CHECK_THAT(cell.state.reason, Contains("replica arm's joint"));
    CHECK(cell.events["arm-jumped"] == 1);
  }
  SECTION("an arm moves although it was commanded to stand") {
    cell.send(testbed_command2_t::HOLD);
    cell.facility->estop_closed = false;
    cell.run_for(2.0);
    for (int i = 0; i < 20; ++i) {
      cell.replica->jump += 0.002;
      cell.run_for(0.1);
    }
    CHECK(cell.events["arm-creeps"] > 0);
  }
  SECTION("an arm does not follow") {
    cell.sensor->stuck = true;
    REQUIRE(cell.run_until([&] { return cell.state.state == testbed_state_t::HELD; }, 10));
    CHECK_THAT(cell.state.reason, Contains("sensor arm's joint"));
    CHECK(cell.sensor->holds > 0);
  }
}

TEST_CASE("ground truth runs at 125 Hz, 20 ms behind, and is where the arms are") {
  FakeCell cell;
  cell.take_lease();
  cell.send(cell.move_to({0, 0, 4500, 5, 0, 0}));
  cell.run_for(4.0);
  cell.truths.clear();
  const Utime from = cell.now();
  cell.run_for(2.0);
  REQUIRE(cell.truths.size() >= 248);
  CHECK(cell.truths.size() <= 251);
  for (std::size_t i = 1; i < cell.truths.size(); ++i) {
    CHECK(cell.truths[i].utime - cell.truths[i - 1].utime == 8000);
  }
  CHECK(cell.truths.front().utime > from - 30 * millisecond);
  CHECK(cell.truths.back().utime <= cell.now());
  CHECK(cell.truths.back().linear_velocity_m_s[2] == Approx(-0.1).margin(0.01));
  CHECK(cell.truths.back().basis == "nominal");
  CHECK(cell.truths.back().calibration_hash.size() == 64);
  for (int i = 0; i < 6; ++i) CHECK(cell.truths.back().covariance[7 * i] > 0);
}

TEST_CASE("in free space the replica flies by itself") {
  FakeCell cell("free");
  cell.take_lease();
  testbed_command2_t move = cell.move_to({100, -230, 8000, 25, 20, -30}, 0.5);
  const std::int64_t seq = cell.send(move);
  REQUIRE(cell.finished(seq, 60));
  cell.run_for(0.5);
  CHECK(distance(cell.relative(), pose_from_xyzwpr({100, -230, 8000, 25, 20, -30})) < 1e-6);
  for (const double q : cell.sensor->joints()) CHECK(q == Approx(0).margin(1e-9));
  CHECK(cell.replica->joints()[2] == Approx(8.0));
  CHECK(cell.state.clearance_m == -1);
}

}  // namespace
}  // namespace berth
