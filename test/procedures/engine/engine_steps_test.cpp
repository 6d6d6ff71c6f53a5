// SPDX-License-Identifier: BSD-3-Clause
#include "test/procedures/engine/engine_bench.h"

using namespace berth;
using fake::EngineBench;
using fake::procedure_of;

TEST_CASE("wait_until waits for its condition, within its timeout") {
  EngineBench bench({},
                    procedure_of("  - acquire: {}\n"
                                 "  - wait_until: estimate is ok and time_in_step > 3 s for 2 s\n"
                                 "  - record: {value: position_error, name: at the end}\n"));
  CHECK(bench.run() == procedure_state_t::PASS);
  const auto& step = bench.step("wait_until");
  CHECK(seconds(step.utime_end - step.utime_start) == Approx(5).margin(0.2));
  CHECK(bench.step("record").detail == "at the end = 4.0 mm");
  CHECK(bench.event_text("recorded") == "at the end = 4.0 mm");
}

TEST_CASE("a condition that is never met times out, with the value found") {
  EngineBench bench({}, procedure_of("  - wait_until: clearance > 2 m\n    timeout: 4 s\n"));
  CHECK(bench.run() == procedure_state_t::TIMEOUT);
  CHECK(bench.step("wait_until").detail ==
        "step 'wait_until' is not done after 4 s: clearance 1.000 m; expected: clearance > 2 m");
}

TEST_CASE("unknown values cannot be recorded") {
  EngineBench bench({}, procedure_of("  - record: estimated_range\n"));
  CHECK(bench.run() == procedure_state_t::FAIL);
  CHECK(bench.node->state().reason == "step 'record': estimated_range = not known");
}

TEST_CASE("a step whose condition is not met is skipped with the reason, with its block") {
  EngineBench bench({}, procedure_of("  - wait: 1 s\n"
                                     "    name: never\n"
                                     "    if: estimate is ok\n"
                                     "  - repeat:\n"
                                     "      times: 2\n"
                                     "      steps:\n"
                                     "        - wait: 1 s\n"
                                     "    if: testbed is moving\n"
                                     "  - acquire: {}\n"
                                     "  - wait: 1 s\n"
                                     "    name: now\n"
                                     "    if: estimate is ok\n"));
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.step("never").state == procedure_step_t::SKIPPED);
  CHECK(bench.step("never").detail == "estimate is not known; only if estimate is ok");
  CHECK(bench.step("never").utime_start == 0);
  CHECK(bench.step("wait (1 of 2)").state == procedure_step_t::SKIPPED);
  CHECK(bench.step("wait (2 of 2)").state == procedure_step_t::SKIPPED);
  CHECK(bench.step("wait (2 of 2)").depth == 1);
  CHECK(bench.step("now").state == procedure_step_t::PASSED);
}

TEST_CASE("a step that fails is tried again") {
  fake::Script s;
  s.acquire_takes_s = 1000;
  EngineBench bench(
      s, procedure_of("  - acquire: {}\n    timeout: 3 s\n    on_failure: retry 2 times\n"));
  CHECK(bench.run() == procedure_state_t::TIMEOUT);
  CHECK(bench.step("acquire").attempts == 3);
  CHECK(bench.step("acquire").state == procedure_step_t::TIMEOUT);
  CHECK(bench.event_text("step-tried-again").find("step 'acquire' is not done after 3 s") == 0);
}

TEST_CASE("a run goes on past a failure when it may") {
  fake::Script s;
  s.refuse_moves = "out of reach";
  EngineBench bench(s, procedure_of("  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 1 mm/s}\n"
                                    "    on_failure: continue\n"
                                    "  - wait: 1 s\n"));
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.step("move").state == procedure_step_t::ERROR);
  CHECK(bench.step("move").detail == "step 'move': the testbed refuses: out of reach");
  CHECK(bench.step("wait").state == procedure_step_t::PASSED);
}

TEST_CASE("a scan that the LIDAR refuses is an error, with its reason") {
  const std::string steps = procedure_of("  - scan: {width: 5 deg, height: 5 deg, count: 500}\n");
  EngineBench good({}, steps);
  CHECK(good.run() == procedure_state_t::PASS);
  fake::Script s;
  s.refuse_scans = "scan 1: window 0: too wide";
  EngineBench bad(s, steps);
  CHECK(bad.run() == procedure_state_t::ERROR);
  CHECK(bad.node->state().reason ==
        "step 'scan': the scan was not made: scan 1: window 0: too wide");
}

TEST_CASE("a closed loop that is stopped has ended when the arms stand: the next step may move") {
  fake::Script s;
  s.stop_takes_s = 1;
  s.move_takes_s = 60;
  EngineBench bench(s, procedure_of("  - acquire: {}\n  - track: {settle: 3}\n"
                                    "  - guided: {by: gnc, for: 2 s, speed: 20 mm/s}\n"
                                    "  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 1 mm/s}\n"));
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.step("move").state == procedure_step_t::PASSED);
}

TEST_CASE("a broken limit ends the run, or holds it") {
  const std::string steps = procedure_of("  - wait: 3 s\n  - wait: 20 s\n    phase: late\n");
  const auto limit = [&](const std::string& then) {
    return steps +
           "limits:\n  - {name: short, watch: time_in_run, max: 5 s, phase: late, then: " + then +
           "}\n";
  };
  SECTION("fail") {
    EngineBench bench({}, limit("fail"));
    CHECK(bench.run() == procedure_state_t::FAIL);
    CHECK(bench.node->state().reason == "limit 'short': time_in_run 5.0 s, not above 5.0 s");
    REQUIRE(bench.node->state().limits.size() == 1);
    CHECK(bench.node->state().limits[0].result == criterion_result_t::FAILED);
    CHECK(bench.testbed_received(testbed_command2_t::STOP));
  }
  SECTION("abort") {
    EngineBench bench({}, limit("abort"));
    CHECK(bench.run() == procedure_state_t::ABORTED);
  }
  SECTION("hold") {
    EngineBench bench({}, limit("hold"));
    bench.run_to(procedure_state_t::HELD);
    CHECK(bench.node->state().reason == "limit 'short': time_in_run 5.0 s, not above 5.0 s");
    bench.run_for(2);
    bench.command(procedure_command_t::RESUME);
    bench.run_for(1);
    CHECK(bench.node->state().state == procedure_state_t::HELD);
    CHECK_FALSE(bench.precondition("limits").met);
    bench.command(procedure_command_t::ABORT);
    CHECK(bench.run() == procedure_state_t::ABORTED);
  }
  SECTION("in its phase alone") {
    EngineBench bench({},
                      procedure_of("  - wait: 8 s\n  - wait: 1 s\n    phase: late\n") +
                          "limits:\n  - {name: a, watch: time_in_phase, max: 5 s, phase: late}\n");
    CHECK(bench.run() == procedure_state_t::PASS);
    CHECK(bench.node->state().limits[0].result == criterion_result_t::PASSED);
  }
}

TEST_CASE("without an operator, a hold ends the run") {
  fake::Script s;
  s.attended = false;
  SECTION("a step that fails") {
    EngineBench bench(s, procedure_of("  - wait_until: time_in_run > 100 s\n    timeout: 2 s\n"
                                      "    on_failure: retry 1 time, then hold\n"));
    CHECK(bench.run() == procedure_state_t::TIMEOUT);
    CHECK_THAT(bench.node->state().reason, Catch::Matchers::Contains("is not done after 2 s") &&
                                               Catch::Matchers::Contains("no operator to decide"));
    CHECK(bench.step("wait_until").attempts == 2);
  }
  SECTION("a limit") {
    EngineBench bench(s, procedure_of("  - wait: 9 s\n") +
                             "limits:\n  - {name: a, watch: time_in_run, max: 5 s, then: hold}\n");
    CHECK(bench.run() == procedure_state_t::FAIL);
    CHECK_THAT(bench.node->state().reason, Catch::Matchers::Contains("limit 'a'"));
  }
}

TEST_CASE("injections are repeated until the simulated cell acknowledges, and cleared at the end") {
  const std::string text = procedure_of(
      "  - inject: {device: plc, fault: delayed, value: 2 s, for: 5 s}\n"
      "  - wait: 1 s\n");
  fake::Script s;
  SECTION("accepted") {
    s.simulated_cell = true;
    EngineBench bench(s, text);
    CHECK(bench.run() == procedure_state_t::PASS);
    REQUIRE(bench.cell->obeyed.size() == 2);
    CHECK(bench.cell->obeyed[0].fault == "delayed");
    CHECK(bench.cell->obeyed[0].value == 2);
    CHECK(bench.cell->obeyed[0].duration_s == 5);
    CHECK(bench.cell->obeyed[1].action == injection_t::CLEAR_ALL);
    CHECK(bench.step("clear_injections").state == procedure_step_t::PASSED);
  }
  SECTION("refused") {
    s.simulated_cell = true;
    s.refuse_injections = "no such fault; there are: noise";
    EngineBench bench(s, text);
    CHECK(bench.run() == procedure_state_t::ERROR);
    CHECK(bench.node->state().reason ==
          "step 'inject': the simulated cell refuses: no such fault; there are: noise");
  }
  SECTION("a real cell") {
    EngineBench bench(s, text);
    CHECK(bench.run() == procedure_state_t::ERROR);
    CHECK(bench.step("inject").detail.find("only a simulated cell can be injected") !=
          std::string::npos);
  }
}

TEST_CASE("a calibration waits at every pose for good estimates made at rest") {
  EngineBench bench({},
                    procedure_of("  - acquire: {}\n"
                                 "  - calibrate:\n"
                                 "      poses: [[0, 0, 5000, 0, 0, 0], [0, 0, 5000, 10, 0, 0]]\n"
                                 "      estimates: 6\n"
                                 "      settle: 1 s\n"
                                 "      speed: 100 mm/s\n"));
  CHECK(bench.run() == procedure_state_t::PASS);
  const auto& dwell = bench.step("dwell (pose 2 of 2)");
  CHECK(dwell.detail == "6 of 6 good estimates");
  // Two estimates a second, the first one a second and a half after the motion.
  CHECK(seconds(dwell.utime_end - dwell.utime_start) == Approx(3.9).margin(0.4));
}

TEST_CASE("a calibration leaves out the poses at which the target is not seen, and goes on") {
  fake::Script s;
  s.move_takes_s = 4;
  s.lost_from_s = 11;  // at the first pose
  s.seen_again_s = 60;
  EngineBench bench(s, procedure_of("  - acquire: {}\n"
                                    "  - calibrate:\n"
                                    "      poses: [[0, 0, 5000, 0, 0, 0], [0, 0, 5000, 10, 0, 0],"
                                    " [0, 0, 5000, 20, 0, 0]]\n"
                                    "      estimates: 12\n"
                                    "      speed: 100 mm/s\n"
                                    "lost_for: 5 s\n"));
  CHECK(bench.run() == procedure_state_t::PASS);
  const auto& first = bench.step("dwell (pose 1 of 3)");
  CHECK(first.state == procedure_step_t::FAILED);
  CHECK(first.detail.find("the estimator lost the target: no good estimate for 5 s") == 0);
  CHECK(bench.event_text("step-left").find("step 'dwell (pose 1 of 3)' is left: ") == 0);
  CHECK(bench.step("find (pose 2 of 3)").state == procedure_step_t::TIMEOUT);
  CHECK(bench.step("dwell (pose 2 of 3)").state == procedure_step_t::SKIPPED);
  CHECK(bench.step("dwell (pose 2 of 3)").detail == "estimate is lost; only if estimate is ok");
  CHECK(bench.step("move (pose 3 of 3)").state == procedure_step_t::PASSED);
  CHECK(bench.step("find (pose 3 of 3)").state == procedure_step_t::PASSED);
  CHECK(bench.step("dwell (pose 3 of 3)").state == procedure_step_t::PASSED);
}

TEST_CASE("nothing begins while the E-stop chain is open, and the list shows it") {
  fake::Script s;
  s.estop_closed = false;
  EngineBench bench(s, procedure_of("  - wait: 1 s\n"));
  bench.run_for(5);
  CHECK(bench.node->state().state == procedure_state_t::PREPARING);
  CHECK_FALSE(bench.precondition("E-stop chain").met);
  CHECK(bench.precondition("fence").met);
  CHECK(bench.precondition("node testbed").met);
  CHECK(bench.precondition("lease").met);
  CHECK(bench.precondition("LIDAR").met);
  SECTION("until it is closed") {
    bench.script.estop_closed = true;
    CHECK(bench.run() == procedure_state_t::PASS);
  }
  SECTION("for too long") {
    CHECK(bench.run() == procedure_state_t::ERROR);
    CHECK(bench.node->state().reason == "not ready to move: E-stop chain: open");
  }
}

TEST_CASE("many steps with all their texts fit into one message") {
  // 380 steps that fail, each with a long reason.
  EngineBench bench({}, procedure_of("  - repeat:\n"
                                     "      times: 380\n"
                                     "      steps:\n"
                                     "        - record: {value: estimated_range, name: " +
                                     std::string(120, 'n') +
                                     "}\n"
                                     "          on_failure: continue\n"));
  CHECK(bench.run(600) == procedure_state_t::PASS);
  CHECK(bench.step("record (380 of 380)").state == procedure_step_t::FAILED);
  CHECK(bench.node->state().getEncodedSize() < Bus::max_message_bytes);
}
