// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/core/error.h"
#include "evaluation/compare/comparison.h"
#include "procedures/engine/node_watch.h"
#include "test/catch.h"
#include "test/procedures/engine/engine_bench.h"

using namespace berth;
using fake::EngineBench;
using fake::procedure_of;
using fake::script_text;

namespace {

namespace fs = std::filesystem;

}  // namespace

TEST_CASE("a good run passes, and its log reproduces the verdict, number for number") {
  EngineBench bench;
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.node->exit_code() == 0);
  const procedure_state_t& state = bench.node->state();
  CHECK(state.state == procedure_state_t::FINISHED);
  for (const auto& step : state.steps) CHECK(step.state == procedure_step_t::PASSED);
  CHECK(seconds(bench.step("hold").utime_end - bench.step("hold").utime_start) ==
        Approx(4).margin(0.06));
  REQUIRE(state.criteria.size() == 3);
  CHECK(state.criteria[0].value == Approx(4).margin(0.01));
  CHECK(state.criteria[0].samples == 8);

  const evaluation::Comparison c = evaluation::compare_log(bench.log);
  CHECK(c.agrees);
  CHECK(c.outcome == procedure_state_t::PASS);
  REQUIRE(c.criteria.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(c.criteria[i].value == state.criteria[i].value);
    CHECK(c.criteria[i].uncertainty == state.criteria[i].uncertainty);
  }
  CHECK(c.info->run == "test-run");
}

TEST_CASE("an estimate that comes after the verdict changes nothing of it") {
  EngineBench bench;
  CHECK(bench.run() == procedure_state_t::PASS);
  // A machine under load: true while the target was tracked, received after the run was judged.
  pose_estimate_t late{};
  late.utime = bench.step("hold").utime_start + 100 * millisecond;
  late.seq = 1000000;
  late.session = fake::session;
  late.status = pose_estimate_t::OK;
  late.position_m[2] = 50;
  late.q_wxyz[0] = late.measured_q_wxyz[0] = 1;
  for (int i = 0; i < 6; ++i) late.covariance[7 * i] = 1e-6;
  bench.operator_bus->publish(channels::pose_estimate, late);
  bench.run_for(0.5);
  bench.writer->flush();
  const evaluation::Comparison comparison = evaluation::compare_log(bench.log);
  CHECK(comparison.outcome == procedure_state_t::PASS);
  CHECK(comparison.agrees);
}

TEST_CASE("every command is obeyed once, in the order of the steps") {
  fake::Script script;
  script.commands_lost = 5;
  script.late_refusals = 2;
  EngineBench bench(script);
  CHECK(bench.run() == procedure_state_t::PASS);
  std::vector<int> testbed;
  for (const auto& c : bench.testbed->obeyed) testbed.push_back(c.command);
  CHECK(testbed == std::vector<int>{testbed_command2_t::MOVE, testbed_command2_t::APPROACH,
                                    testbed_command2_t::RELEASE_LEASE});
  std::vector<int> estimator;
  for (const auto& c : bench.estimator->obeyed) estimator.push_back(c.command);
  CHECK(estimator == std::vector<int>{estimator_command_t::ACQUIRE, estimator_command_t::TRACK,
                                      estimator_command_t::STOP});
  CHECK(bench.testbed->obeyed[0].position_m[2] == Approx(5));
  CHECK(bench.testbed->obeyed[0].speed_m_s == Approx(0.1));
  CHECK(bench.testbed->obeyed[1].standoff_m == Approx(3.2));
  CHECK(bench.estimator->obeyed[0].returns_per_scan == 3000);
  CHECK(bench.facility->sun() == 0);  // switched off at the end
}

TEST_CASE("a criterion that fails fails the run") {
  fake::Script script;
  script.position_error_m = 0.05;
  EngineBench bench(script);
  CHECK(bench.run() == procedure_state_t::FAIL);
  CHECK(bench.node->exit_code() == 1);
  CHECK(bench.node->state().criteria[0].result == criterion_result_t::FAILED);
  CHECK(evaluation::compare_log(bench.log).agrees);
}

TEST_CASE("without truth the run is inconclusive") {
  fake::Script script;
  script.truth = false;
  EngineBench bench(script);
  CHECK(bench.run() == procedure_state_t::INCONCLUSIVE);
  CHECK(bench.node->exit_code() == 4);
  CHECK(bench.node->state().criteria[0].reason == "no truth for any of 8 estimates");
  CHECK(evaluation::compare_log(bench.log).agrees);
}

TEST_CASE("a step that takes too long ends the run, and the teardown still runs") {
  fake::Script script;
  script.acquire_takes_s = 1000;
  EngineBench bench(script);
  CHECK(bench.run() == procedure_state_t::TIMEOUT);
  CHECK(bench.node->exit_code() == 2);
  CHECK(bench.node->state().reason ==
        "step 'acquire' is not done after 10 s: 0 of 1 good estimates: made so");
  CHECK(bench.step("acquire").state == procedure_step_t::TIMEOUT);
  CHECK(bench.step("approach").state == procedure_step_t::PENDING);
  CHECK(bench.step("stop_tracking").state == procedure_step_t::PASSED);
  CHECK(bench.step("lights off").state == procedure_step_t::PASSED);
  CHECK(bench.facility->sun() == 0);
  CHECK(evaluation::compare_log(bench.log).agrees);
}

TEST_CASE("an estimator that loses the target fails the run") {
  fake::Script script;
  script.move_takes_s = 20;
  script.lost_from_s = 30;  // on approach
  EngineBench bench(script, std::string(script_text) + "lost_for: 5 s\n");
  CHECK(bench.run() == procedure_state_t::FAIL);
  CHECK(bench.node->state().reason.find(
            "the estimator lost the target: no good estimate for 5 s") == 0);
  CHECK(bench.step("approach").state == procedure_step_t::FAILED);
  CHECK(bench.testbed_received(testbed_command2_t::STOP));
}

TEST_CASE("an estimate with status ok but no covariance is no good estimate") {
  fake::Script script;
  script.move_takes_s = 20;
  script.certain_from_s = 30;  // on approach
  EngineBench bench(script, std::string(script_text) + "lost_for: 5 s\n");
  CHECK(bench.run() == procedure_state_t::FAIL);
  CHECK(bench.node->state().reason.find(
            "the estimator lost the target: no good estimate for 5 s") == 0);
}

TEST_CASE("a rig at fault is an error and no failed test") {
  fake::Script script;
  std::string reason;
  SECTION("testbed fault") {
    script.testbed_fault_from_s = 4;
    reason = "testbed fault: made to fail";
  }
  SECTION("node fault") {
    script.estimator_fault_from_s = 6;
    reason = "node estimator: FAULT: made to fail";
  }
  SECTION("a node falls silent") {
    script.lidar_silent_from_s = 4;
    reason = "node lidar-driver is silent";
  }
  SECTION("the lease is lost") {
    script.lease_lost_from_s = 4;
    reason = "lost the lease";
  }
  SECTION("a motion is refused") {
    script.refuse_moves = "joint 5 of replica at its limit";
    reason = "step 'move': the testbed refuses: joint 5 of replica at its limit";
  }
  EngineBench bench(script);
  CHECK(bench.run() == procedure_state_t::ERROR);
  CHECK(bench.node->exit_code() == 2);
  CHECK(bench.node->state().reason == reason);
  CHECK(bench.facility->sun() == 0);
  const evaluation::Comparison c = evaluation::compare_log(bench.log);
  CHECK(c.outcome == procedure_state_t::ERROR);
  CHECK(c.agrees);
}

TEST_CASE("nothing moves while a node is missing or another commander has the lease") {
  fake::Script script;
  std::string reason;
  SECTION("nodes not ready") {
    script.ready_after_s = 1000;
    reason =
        "not ready within 5 s: estimator (STARTING), facility-driver (STARTING), lidar-driver "
        "(STARTING), testbed (STARTING)";
  }
  SECTION("lease") {
    script.other_holder = "somebody";
    reason = "no lease on the testbed within 15 s: somebody has it";
  }
  EngineBench bench(script);
  CHECK(bench.run() == procedure_state_t::ERROR);
  CHECK(bench.node->state().reason == reason);
  CHECK_FALSE(bench.testbed_received(testbed_command2_t::MOVE));
  for (const auto& step : bench.node->state().steps) CHECK(step.state == procedure_step_t::PENDING);
}

TEST_CASE("a node of which nothing was received is named") {
  fake::Script script;
  script.lidar_silent_from_s = 0;
  EngineBench bench(script);
  CHECK(bench.run() == procedure_state_t::ERROR);
  CHECK(bench.node->state().reason == "not ready within 5 s: lidar-driver (nothing received)");
}

TEST_CASE("for a node that is started elsewhere the command is shown, until it is there") {
  procedures::NodeWatch watch({"estimator", "testbed"}, "", {{"estimator", "start it"}});
  CHECK(watch.missing() == "estimator (nothing received: start it), testbed (nothing received)");
  CHECK(watch.awaited() == "estimator (start it), testbed");
  node_status_t status{};
  status.node = "estimator";
  status.state = node_status_t::READY;
  watch.on(status);
  CHECK(watch.awaited() == "testbed");
}

TEST_CASE("lamps that do not answer time out, also in the teardown") {
  fake::Script script;
  script.lamps_work = false;
  EngineBench bench(script,
                    "name: dark\nsteps:\n  - wait: 1 s\nteardown:\n  - lights: {sun: 10 %}\n");
  CHECK(bench.run() == procedure_state_t::ERROR);
  CHECK(bench.node->state().reason == "teardown step 'lights' failed: sun lamp 0.00 % of 10.00 %");
}

TEST_CASE("lamps that the facility refuses end the step with its reason") {
  fake::Script script;
  script.refuse_lamps = "levels must be 0 to 1";
  EngineBench bench(script, procedure_of("  - lights: {sun: 10 %}\n"));
  CHECK(bench.run() == procedure_state_t::ERROR);
  CHECK(bench.step("lights").detail ==
        "step 'lights': the facility refuses: levels must be 0 to 1");
}

TEST_CASE("the lights are done when the lamp has turned, and a command that is lost is repeated") {
  fake::Script script;
  const std::string steps =
      "  - lights: {sun: 50 %, azimuth: 30 deg}\n"
      "  - lights: {sun: 50 %, azimuth: 60 deg, elevation: 10 deg}\n    name: turned\n";
  const auto seconds_of = [](const EngineBench& bench, const std::string& name) {
    return seconds(bench.step(name).utime_end - bench.step(name).utime_start);
  };
  SECTION("it turns") {
    script.lamp_turns_s = 3;
    EngineBench bench(script, procedure_of(steps));
    CHECK(bench.run() == procedure_state_t::PASS);
    CHECK(seconds_of(bench, "turned") == Approx(3).margin(0.2));
  }
  SECTION("a command is lost that changes nothing but the direction") {
    script.lamp_command_lost = 2;
    EngineBench bench(script, procedure_of(steps));
    REQUIRE(bench.simulation.run_until(
        [&] { return bench.step("turned").state == procedure_step_t::PASSED; },
        bench.simulation.now() + 20 * second));
    CHECK(bench.facility->last.sun_azimuth_rad == Approx(radians(60.0)));
    CHECK(seconds_of(bench, "turned") == Approx(0.6).margin(0.15));  // repeated after half a second
  }
  SECTION("a lamp that never gets there reports how far it is") {
    script.lamp_turns_s = 1000;
    EngineBench bench(script, procedure_of(steps + "teardown:\n  - wait: 1 s\n"));
    CHECK(bench.run() == procedure_state_t::TIMEOUT);
    CHECK(bench.node->state().reason ==
          "step 'lights' is not done after 20 s: azimuth 0.00 deg of 30.00 deg");
  }
}

TEST_CASE("abort stops the arms, tears down and keeps its reason") {
  fake::Script script;
  script.move_takes_s = 30;
  EngineBench bench(script);
  bench.run_for(10);
  CHECK(bench.step("move").state == procedure_step_t::RUNNING);
  bench.command(procedure_command_t::ABORT, "smoke");
  CHECK(bench.run() == procedure_state_t::ABORTED);
  CHECK(bench.node->exit_code() == 3);
  CHECK(bench.node->state().reason == "smoke");
  CHECK(bench.step("move").state == procedure_step_t::ABORTED);
  CHECK(bench.step("lights off").state == procedure_step_t::PASSED);
  CHECK(bench.testbed->obeyed[1].command == testbed_command2_t::STOP);
  CHECK(evaluation::compare_log(bench.log).outcome == procedure_state_t::ABORTED);
}

TEST_CASE("abort works before anything has begun, and a second one cuts the teardown short") {
  fake::Script script;
  SECTION("before") {
    script.ready_after_s = 1000;
    EngineBench bench(script);
    bench.run_for(1);
    bench.command(procedure_command_t::ABORT);
    CHECK(bench.run() == procedure_state_t::ABORTED);
    CHECK(bench.node->state().reason == "aborted by operator");
  }
  SECTION("twice") {
    script.lamps_work = false;
    EngineBench bench(script,
                      "name: dark\nsteps:\n  - wait: 20 s\nteardown:\n  - lights: {sun: 10 %}\n");
    bench.run_for(4);
    bench.command(procedure_command_t::ABORT);
    bench.run_for(2);
    CHECK_FALSE(bench.node->finished());
    bench.command(procedure_command_t::ABORT);
    CHECK(bench.run(8) == procedure_state_t::ABORTED);
  }
}

TEST_CASE("commands that are late or of another session are not obeyed") {
  // Without criteria: what the made estimator sees does not wait.
  EngineBench bench({}, std::string(script_text).substr(0, std::string(script_text).find("crit")));
  bench.run_for(3);
  procedure_command_t message{};
  message.seq = 100;
  message.session = fake::session;
  message.command = procedure_command_t::STEP;
  message.utime_expires = bench.simulation.now() - second;
  bench.operator_bus->publish(channels::procedure_command, message);
  message.seq = 101;
  message.session = fake::session + 1;
  message.utime_expires = bench.simulation.now() + second;
  bench.operator_bus->publish(channels::procedure_command, message);
  bench.run_for(1);
  CHECK(bench.node->state().state == procedure_state_t::RUNNING);
  CHECK(bench.event_text("operator-command").empty());

  // A repeat is no new command; the first one of another terminal is.
  message.seq = 1;
  message.session = fake::session;
  message.utime = bench.simulation.now();
  message.utime_expires = message.utime + 10 * second;
  message.command = procedure_command_t::HOLD;
  bench.operator_bus->publish(channels::procedure_command, message);
  bench.run_for(1.5);  // until it has come to rest
  procedure_command_t other = message;
  other.commander = "second terminal";
  other.command = procedure_command_t::RESUME;
  bench.operator_bus->publish(channels::procedure_command, other);
  bench.run_for(0.5);
  bench.operator_bus->publish(channels::procedure_command, message);
  CHECK(bench.run() == procedure_state_t::PASS);
}

TEST_CASE("a hold and an abort are obeyed whatever their session and age, and reported by name") {
  EngineBench bench;
  bench.run_for(3);
  procedure_command_t message{};
  message.seq = 100;
  message.utime = bench.simulation.now();
  message.session = fake::session;
  message.utime_expires = bench.simulation.now() + second;
  message.commander = "somebody";
  message.command = GENERATE(procedure_command_t::HOLD, procedure_command_t::ABORT);
  std::string reason;
  SECTION("late") {
    message.utime_expires -= 3601 * second;
    reason = "expired 3600000 ms ago";
  }
  SECTION("of another session") {
    message.session += 1;
    reason = "belongs to session " + std::to_string(fake::session + 1);
  }
  bench.operator_bus->publish(channels::procedure_command, message);
  bench.run_for(0.1);
  const bool holds = message.command == procedure_command_t::HOLD;
  CHECK(bench.node->state().state ==
        (holds ? procedure_state_t::HELD : procedure_state_t::TEARDOWN));
  CHECK(bench.event_text("unusual-stop") ==
        std::string(holds ? "hold" : "abort") + " of 'somebody' is obeyed, although it " + reason);
  if (!holds) return;
  // a repetition of it does not hold what has been resumed
  bench.run_for(2);
  bench.command(procedure_command_t::RESUME);
  bench.run_for(0.1);
  bench.operator_bus->publish(channels::procedure_command, message);
  bench.run_for(0.1);
  CHECK(bench.node->state().state == procedure_state_t::RUNNING);
}

TEST_CASE("a hold is never too early or too late") {
  fake::Script script;
  script.move_takes_s = 6;
  SECTION("before the first step: nothing moves") {
    EngineBench bench(script,
                      procedure_of("  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 50 mm/s}\n"));
    bench.run_for(0.2);
    CHECK(bench.node->state().state == procedure_state_t::PREPARING);
    bench.command(procedure_command_t::HOLD);
    bench.run_to(procedure_state_t::HELD);
    bench.run_for(0.2);  // until the testbed has received it
    const auto last = bench.testbed->obeyed.back();
    CHECK(last.command == testbed_command2_t::HOLD);
    bench.run_for(2);
    CHECK(bench.node->state().state == procedure_state_t::HELD);
    bench.command(procedure_command_t::RESUME);
    CHECK(bench.run() == procedure_state_t::PASS);
  }
  SECTION("while the arms come to rest between two steps") {
    script.stop_takes_s = 2;
    EngineBench bench(script,
                      procedure_of("  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 50 mm/s}\n"
                                   "  - move: {to: [0, 0, 5100, 0, 0, 0], speed: 50 mm/s}\n"));
    bench.run_for(3);
    bench.command(procedure_command_t::SKIP, "to see");
    bench.run_for(0.5);
    bench.command(procedure_command_t::HOLD);
    bench.run_to(procedure_state_t::HELD);
    bench.run_for(0.2);  // until the testbed has received it
    CHECK(bench.testbed->obeyed.back().command == testbed_command2_t::HOLD);
  }
  SECTION("in the teardown: its motion is stopped, the rest is left out") {
    EngineBench bench(script,
                      procedure_of("  - wait: 1 s\nteardown:\n"
                                   "  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 50 mm/s}\n"
                                   "  - move: {to: [0, 0, 5100, 0, 0, 0], speed: 50 mm/s}\n"));
    bench.run_to(procedure_state_t::TEARDOWN);
    bench.run_for(1);
    bench.command(procedure_command_t::HOLD);
    bench.run_for(0.3);
    CHECK(bench.testbed_received(testbed_command2_t::STOP));
    bench.run(8);
    CHECK(std::count_if(bench.testbed->obeyed.begin(), bench.testbed->obeyed.end(),
                        [](const testbed_command2_t& c) {
                          return c.command == testbed_command2_t::MOVE;
                        }) == 1);
  }
}

TEST_CASE("on hold the arms wait and the step's clock stands still") {
  fake::Script script;
  script.move_takes_s = 6;
  // Without criteria: the made flight does not wait.
  EngineBench bench(script,
                    std::string(script_text).substr(0, std::string(script_text).find("crit")));
  const auto hold_for = [&bench](double s) {
    bench.command(procedure_command_t::HOLD);
    bench.run_for(s);
    CHECK(bench.node->state().state == procedure_state_t::HELD);
    bench.command(procedure_command_t::RESUME);
    bench.run_for(0.2);
    CHECK(bench.node->state().state == procedure_state_t::RUNNING);
  };
  bench.run_for(4);
  hold_for(300);  // longer than the move's time limit
  REQUIRE(bench.simulation.run_until(
      [&bench] { return bench.step("hold").state == procedure_step_t::RUNNING; },
      bench.simulation.now() + 60 * second));
  hold_for(20);
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(seconds(bench.step("hold").utime_end - bench.step("hold").utime_start) ==
        Approx(24).margin(0.1));
  CHECK(bench.printed("HELD"));
}

TEST_CASE("a step can be skipped with a reason, and steps taken one by one") {
  fake::Script script;
  script.move_takes_s = 30;
  // Without criteria: what the made estimator sees does not wait.
  EngineBench bench(script,
                    std::string(script_text).substr(0, std::string(script_text).find("crit")));
  bench.run_for(5);
  bench.command(procedure_command_t::SKIP, "is there already");
  bench.run_for(0.5);
  CHECK(bench.step("move").state == procedure_step_t::SKIPPED);
  CHECK(bench.step("move").detail == "is there already");
  CHECK(bench.testbed_received(testbed_command2_t::STOP));
  CHECK(bench.step("acquire").state == procedure_step_t::RUNNING);

  bench.command(procedure_command_t::HOLD);
  bench.run_for(1);
  bench.command(procedure_command_t::STEP);
  bench.run_for(20);
  CHECK(bench.step("acquire").state == procedure_step_t::PASSED);
  CHECK(bench.step("track").state == procedure_step_t::PENDING);
  CHECK(bench.node->state().state == procedure_state_t::HELD);
  bench.command(procedure_command_t::RESUME);
  bench.script.move_takes_s = 2;
  CHECK(bench.run() == procedure_state_t::PASS);
}

TEST_CASE("the operator reads steps, errors and the verdict") {
  EngineBench bench;
  bench.run_for(9);
  const std::string status = bench.progress.status();
  INFO(status);
  CHECK(status.find("estimate ok, range 4.") != std::string::npos);
  CHECK(status.find("2.0 Hz") != std::string::npos);
  CHECK(status.find("error 4.0 mm 0.00 deg") != std::string::npos);
  CHECK(bench.progress.verdict().empty());
  bench.run();
  CHECK(bench.printed("waiting for estimator, "));
  CHECK(bench.printed("done     approach"));
  REQUIRE(bench.progress.finished());
  const std::string verdict = bench.progress.verdict();
  INFO(verdict);
  CHECK(verdict.find("rms position_error") != std::string::npos);
  CHECK(verdict.find("\nPASS\n") != std::string::npos);
}

TEST_CASE("the same run gives the same log to the bit") {
  const auto log_of_a_run = [] {
    EngineBench bench;
    bench.run();
    std::ifstream in(bench.log, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  const std::string first = log_of_a_run();
  CHECK(first.size() > 100000);
  CHECK((first == log_of_a_run()));
}

TEST_CASE("a run names everything that shaped it, in one datagram") {
  const fs::path folder = fs::temp_directory_path() / ("berth-info-" + std::to_string(::getpid()));
  fs::create_directories(folder / "layouts");
  const auto put = [&folder](const char* name, std::size_t size) {
    std::ofstream(folder / name) << std::string(size, 'x');
  };
  put("layouts/range.yaml", 100);
  put("layouts/contact.yaml", 100);
  put("estimator.yaml", 60000);
  put("testbed.yaml", 30000);
  RunSetup setup;
  setup.config = folder;
  const auto procedure = procedures::parse_procedure(script_text, "test.yaml");
  const auto info =
      procedures::make_run_info(procedure, setup, Target{}, "r", run_info_t::TWIN, "");
  fs::remove_all(folder);
  REQUIRE(info.attachments.size() == 4);
  CHECK(info.attachments[0].name == "procedure.yaml");
  CHECK(info.attachments[0].content == procedure.text);
  CHECK(info.attachments[1].name == "estimator.yaml");
  CHECK(info.attachments[1].content.empty());
  CHECK(info.attachments[1].sha256.size() == 64);
  CHECK(info.attachments[2].name == "testbed.yaml");
  CHECK(info.attachments[2].content.size() == 30000);
  CHECK(info.attachments[3].name == "layouts/range.yaml");
  CHECK(info.attachments[3].content.size() == 100);
  CHECK(info.getEncodedSize() < Bus::max_message_bytes);
}
