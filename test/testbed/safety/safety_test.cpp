// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety/safety.h"

#include "common/bus/loop.h"
#include "common/core/lease.h"
#include "test/catch.h"
#include "testbed/motion/arm_pair.h"
#include "testbed/safety/arm_watch.h"
#include "testbed/safety/estimate_watch.h"

namespace berth::testbed {
namespace {

using Level = SafetySupervisor::Level;
using ArmState = SafetySupervisor::ArmState;

struct Watch {
  SafetySupervisor supervisor{[] {
    SafetySupervisor::Settings settings;
    settings.watched_nodes = {"arm-driver-replica"};
    return settings;
  }()};
  std::int64_t now = 1000000;

  void all_well() {
    for (const ArmRole role : both_arms)
      supervisor.on_arm(role, {now, true, ArmState::running, ""});
    supervisor.on_heartbeat("arm-driver-replica", now);
    supervisor.on_facility(now, true, true, true, true, "");
  }
  Level level(bool engaged = true) { return supervisor.judge(now, {engaged, false}).level; }
};

TEST_CASE("nothing moves before messages of every node have come") {
  Watch watch;
  CHECK(watch.level() == Level::not_ready);
  for (const ArmRole role : both_arms) {
    watch.supervisor.on_arm(role, {watch.now, true, ArmState::idle, ""});
    CHECK(watch.level(false) == Level::not_ready);
  }
  watch.supervisor.on_facility(watch.now, false, true, true, true, "no answer");
  CHECK(watch.level(false) == Level::not_ready);
  watch.supervisor.on_facility(watch.now, true, true, true, true, "");
  CHECK(watch.level(false) == Level::not_ready);
  watch.supervisor.on_heartbeat("arm-driver-replica", watch.now);
  CHECK(watch.level(false) == Level::good);
}

TEST_CASE("silence holds after its limit, and only then") {
  Watch watch;
  watch.all_well();
  CHECK(watch.level() == Level::good);
  const std::int64_t received_at = watch.now;
  watch.now = received_at + 150000;
  CHECK(watch.level() == Level::good);
  watch.now = received_at + 150001;
  CHECK(watch.level() == Level::hold);
  CHECK(watch.supervisor.judge(watch.now, {true, false}).code == "heartbeat-lost");
  watch.supervisor.on_heartbeat("arm-driver-replica", watch.now);
  CHECK(watch.supervisor.judge(watch.now, {true, false}).code == "arm-silent");
  for (const ArmRole role : both_arms) {
    watch.supervisor.on_arm(role, {watch.now, true, ArmState::running, ""});
  }
  CHECK(watch.level() == Level::good);
  watch.supervisor.on_heartbeat("somebody else", watch.now - 10000000);
  CHECK(watch.level() == Level::good);
}

TEST_CASE("conditions that need a reset by hand outrank silence") {
  Watch watch;
  watch.all_well();
  watch.supervisor.on_facility(watch.now, true, false, true, true, "");
  watch.now += 10000000;
  CHECK(watch.supervisor.judge(watch.now, {true, false}).code == "estop");
  watch.all_well();
  watch.supervisor.on_facility(watch.now, true, true, false, true, "");
  CHECK(watch.supervisor.judge(watch.now, {true, false}).code == "fence");
  watch.all_well();
  watch.supervisor.on_arm(ArmRole::sensor, {watch.now, true, ArmState::fault, "SRVO-001"});
  const auto verdict = watch.supervisor.judge(watch.now, {true, false});
  CHECK(verdict.level == Level::fault);
  CHECK_THAT(verdict.reason, Catch::Matchers::Contains("SRVO-001"));
}

TEST_CASE("a controller that does not run matters only while set-points flow") {
  Watch watch;
  watch.all_well();
  watch.supervisor.on_arm(ArmRole::replica, {watch.now, true, ArmState::held, ""});
  CHECK(watch.level(false) == Level::good);
  CHECK(watch.level(true) == Level::held);
}

TEST_CASE("while the estimate steers, the sensor and the estimator are watched too") {
  SafetySupervisor::Settings settings;
  settings.watched_in_closed_loop = {"estimator"};
  SafetySupervisor supervisor(settings);
  Utime now = 1000 * second;
  const auto code = [&](bool closed_loop) {
    for (const ArmRole role : both_arms)
      supervisor.on_arm(role, {now, true, ArmState::running, ""});
    supervisor.on_facility(now, true, true, true, true, "");
    return supervisor.judge(now, {true, closed_loop}).code;
  };
  CHECK(code(false).empty());
  CHECK(code(true) == "heartbeat-unknown");
  supervisor.on_heartbeat("estimator", now);
  CHECK(code(true).empty());
  SECTION("silent estimator") {
    now += 151 * millisecond;
    CHECK(code(true) == "heartbeat-lost");
    CHECK(code(false).empty());
  }
  SECTION("a scan that stops half way, and one that is over") {
    const auto wait = [&](Utime time) {
      now += time;
      supervisor.on_heartbeat("estimator", now);
    };
    supervisor.on_scan(now, true);
    wait(25 * millisecond);
    supervisor.on_scan(now, true);
    wait(200 * millisecond);
    CHECK(code(true).empty());
    wait(1 * millisecond);
    CHECK(code(true) == "scan-silent");
    supervisor.on_scan(now, false);
    wait(10 * second);
    CHECK(code(true).empty());
  }
  SECTION("a slow LIDAR is not a silent one") {
    const auto wait = [&](Utime time) {
      now += time;
      supervisor.on_heartbeat("estimator", now);
    };
    supervisor.on_scan(now, true);
    wait(500 * millisecond);
    supervisor.on_scan(now, true);
    wait(1400 * millisecond);
    CHECK(code(true).empty());
    wait(200 * millisecond);
    CHECK(code(true) == "scan-silent");
  }
  SECTION("a LIDAR that is gone") {
    supervisor.on_lidar("no answer");
    CHECK(code(true) == "lidar-lost");
    CHECK(code(false).empty());
    supervisor.on_lidar("");
    CHECK(code(true).empty());
  }
}

TEST_CASE("a PLC that does not answer holds at once, with its reason") {
  Watch watch;
  watch.all_well();
  watch.supervisor.on_facility(watch.now, false, false, false, false, "no answer within 100 ms");
  const auto verdict = watch.supervisor.judge(watch.now, {true, false});
  CHECK(verdict.level == Level::hold);
  CHECK_THAT(verdict.reason, Catch::Matchers::Contains("no answer within 100 ms"));
}

TEST_CASE("reports that cannot be") {
  const auto arm = ArmKinematics::load("config/arms/m710ic_50.yaml");
  ReportWatch watch("the arm", *arm);
  ReportWatch::Report report;
  report.utime = report.controller_time = 100 * second;
  CHECK_FALSE(watch.check(report));
  const auto next = [&](Utime later, std::size_t joint, double step) {
    report.utime += later;
    report.controller_time += later;
    report.joints[joint] += step;
    return watch.check(report);
  };
  SECTION("as fast as the motors can is believed, on any grid of time") {
    for (const Utime later : {8 * millisecond, 16 * millisecond, 500 * millisecond}) {
      for (std::size_t i = 0; i < 6; ++i) {
        const double step = arm->limits()[i].speed * seconds(later);
        // joint 3 of the pendant moves its motor together with joint 2
        CHECK_FALSE(next(later, i, (i == 1 || i == 2) ? 0.5 * step : step));
      }
    }
  }
  SECTION("further is not") {
    for (std::size_t i = 0; i < 6; ++i) {
      const auto wrong = next(8 * millisecond, i, 0.15);
      REQUIRE(wrong);
      CHECK(wrong->code == "arm-jumped");
    }
  }
  SECTION("after a long silence the way is not judged") { CHECK_FALSE(next(5 * second, 0, 1.5)); }
  SECTION("a clock that goes back") {
    report.controller_time = 0;
    report.utime += 8 * millisecond;
    const auto wrong = watch.check(report);
    REQUIRE(wrong);
    CHECK(wrong->code == "arm-restarted");
    CHECK_FALSE(next(8 * millisecond, 0, 0));
  }
}

TEST_CASE("an estimate is measured against truth of its time, with the uncertainty of both") {
  EstimateWatch watch({0.1, 0.01});
  Truth truth;
  truth.covariance = 1e-6 * Matrix6d::Identity();
  for (int i = 0; i < 1000; ++i) {  // the replica comes nearer at 100 mm/s
    truth.utime = 100 * second + i * 8 * millisecond;
    truth.pose.position = Vector3d(0, 0, 5 - 0.0008 * i);
    watch.on_truth(truth);
  }
  const auto wrong_by = [&](double away, double sigma) {
    EstimateWatch::Position estimate;
    estimate.utime = truth.utime - second;
    estimate.position = Vector3d(0, away, truth.pose.position.z() + 0.1);
    estimate.covariance = sigma * sigma * Matrix3d::Identity();
    watch.on_estimate(estimate);
    return watch.contradiction().has_value();
  };
  CHECK_FALSE(wrong_by(0.10, 0.005));
  CHECK(wrong_by(0.13, 0.005));
  CHECK_FALSE(wrong_by(0.13, 0.02));  // its covariance covers it
  CHECK(wrong_by(0.5, 0.02));
  watch.forget();
  CHECK_FALSE(watch.contradiction());
  SECTION("truth of another time is not used") {
    EstimateWatch::Position estimate;
    estimate.utime = truth.utime + second;
    watch.on_estimate(estimate);
    CHECK_FALSE(watch.contradiction());
  }
}

TEST_CASE("where arms would stand: a reaction further, and the way to brake") {
  const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  ArmPair before{cell.replica.home, cell.sensor.home};
  ArmPair now = before;
  now.replica[0] += 0.02;
  const ArmPair place = stopping_place(cell, before, now, 0.1, 0.1);
  const double a = cell.replica.kinematics->limits()[0].acceleration;
  CHECK(place.replica[0] - now.replica[0] == Approx(0.2 * 0.1 + 0.2 * 0.2 / (2 * a)));
  CHECK(place.sensor == now.sensor);
  CHECK(place.replica[1] == now.replica[1]);
}

TEST_CASE("the lease is held by one commander, while its messages come") {
  Lease lease(2000000);
  CHECK_FALSE(lease.held(0));
  CHECK(lease.take("a", 0));
  CHECK_FALSE(lease.take("b", 1000000));
  CHECK_FALSE(lease.keep("b", 1000000));
  CHECK_FALSE(lease.release("b", 1000000));
  CHECK(lease.keep("a", 1500000));
  CHECK_FALSE(lease.lapse(3500000));
  CHECK(lease.lapse(3500001));
  CHECK_FALSE(lease.lapse(3500002));
  CHECK_FALSE(lease.keep("a", 3500003));
  CHECK(lease.take("b", 3500004));
  CHECK(lease.release("b", 3500005));
  CHECK(lease.take("a", 3500006));
}

}  // namespace
}  // namespace berth::testbed
