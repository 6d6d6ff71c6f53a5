// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety.h"

#include "common/core/lease.h"
#include "test/catch.h"

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
  Level level(bool engaged = true) { return supervisor.judge(now, engaged).level; }
};

TEST_CASE("nothing moves before everybody has been heard") {
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
  const std::int64_t heard = watch.now;
  watch.now = heard + 150000;
  CHECK(watch.level() == Level::good);
  watch.now = heard + 150001;
  CHECK(watch.level() == Level::hold);
  CHECK(watch.supervisor.judge(watch.now, true).code == "arm-silent");
  for (const ArmRole role : both_arms) {
    watch.supervisor.on_arm(role, {watch.now, true, ArmState::running, ""});
  }
  CHECK(watch.supervisor.judge(watch.now, true).code == "heartbeat-lost");
  watch.supervisor.on_heartbeat("arm-driver-replica", watch.now);
  CHECK(watch.level() == Level::good);
  watch.supervisor.on_heartbeat("somebody else", watch.now - 10000000);
  CHECK(watch.level() == Level::good);
}

TEST_CASE("what must be put right by hand outranks silence") {
  Watch watch;
  watch.all_well();
  watch.supervisor.on_facility(watch.now, true, false, true, true, "");
  watch.now += 10000000;
  CHECK(watch.supervisor.judge(watch.now, true).code == "estop");
  watch.all_well();
  watch.supervisor.on_facility(watch.now, true, true, false, true, "");
  CHECK(watch.supervisor.judge(watch.now, true).code == "fence");
  watch.all_well();
  watch.supervisor.on_arm(ArmRole::sensor, {watch.now, true, ArmState::fault, "SRVO-001"});
  const auto verdict = watch.supervisor.judge(watch.now, true);
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

TEST_CASE("the lease is for one, as long as he is heard") {
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
