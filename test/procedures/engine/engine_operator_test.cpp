// SPDX-License-Identifier: BSD-3-Clause
#include "test/procedures/engine/engine_bench.h"

using namespace berth;
using fake::EngineBench;
using fake::procedure_of;

namespace {

const std::string with_prompt = procedure_of(
    "  - prompt: {text: Ready for it, choices: [go, no], go_on: [go]}\n"
    "    timeout: 10 s\n"
    "  - wait: 1 s\n");

}  // namespace

TEST_CASE("an operator is prompted, and the answer with the prompt's id counts") {
  EngineBench bench({}, with_prompt);
  bench.run_to(procedure_state_t::PROMPTING);
  const procedure_state_t prompting = bench.node->state();
  CHECK(prompting.prompt == "Ready for it");
  CHECK(prompting.choices == std::vector<std::string>{"go", "no"});
  CHECK(seconds(prompting.utime_prompt_expires - prompting.steps[0].utime_start) == Approx(10));
  SECTION("go") {
    bench.command(procedure_command_t::ANSWER, "go", prompting.prompt_id);
    CHECK(bench.run() == procedure_state_t::PASS);
    CHECK(bench.step("prompt").detail == "answer: go (operator)");
    CHECK(bench.node->state().prompt_id.empty());
  }
  SECTION("no") {
    bench.command(procedure_command_t::ANSWER, "no", prompting.prompt_id);
    CHECK(bench.run() == procedure_state_t::FAIL);
    CHECK(bench.node->state().reason == "step 'prompt': answer: no (operator)");
  }
  SECTION("another prompt") {
    bench.command(procedure_command_t::ANSWER, "go", "17.1");
    bench.run_for(1);
    CHECK(bench.node->state().state == procedure_state_t::PROMPTING);
    CHECK(bench.event_text("command-refused").find("prompt 17.1 is not open") != std::string::npos);
  }
  SECTION("no choice") {
    bench.command(procedure_command_t::ANSWER, "perhaps", prompting.prompt_id);
    bench.run_for(1);
    CHECK(bench.node->state().state == procedure_state_t::PROMPTING);
    CHECK(bench.event_text("command-refused").find("expected one of: go, no") != std::string::npos);
  }
  SECTION("no answer") {
    CHECK(bench.run() == procedure_state_t::TIMEOUT);
    CHECK(bench.step("prompt").state == procedure_step_t::TIMEOUT);
  }
  SECTION("on hold the prompt waits") {
    bench.command(procedure_command_t::HOLD);
    bench.run_for(30);
    CHECK(bench.node->state().state == procedure_state_t::HELD);
    bench.command(procedure_command_t::RESUME);
    bench.run_for(0.5);
    CHECK(bench.node->state().state == procedure_state_t::PROMPTING);
    bench.command(procedure_command_t::ANSWER, "go", prompting.prompt_id);
    CHECK(bench.run() == procedure_state_t::PASS);
  }
}

TEST_CASE("without an answer, a prompt can take its default") {
  EngineBench bench(
      {}, procedure_of("  - prompt: {text: Ready for it, choices: [go, no], default: go}\n"
                       "    timeout: 10 s\n"));
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.step("prompt").detail == "answer: go (default, no answer in time)");
}

TEST_CASE("nothing goes on after a hold when something has changed") {
  fake::Script s;
  s.move_takes_s = 10;
  std::string red;
  SECTION("somebody has moved an arm") {
    s.moved_on_hold_m = 0.02;
    red = "relative pose";
  }
  SECTION("the E-stop chain is open") { red = "E-stop chain"; }
  EngineBench bench(s, procedure_of("  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}\n"));
  bench.run_for(5);
  bench.command(procedure_command_t::HOLD);
  bench.run_for(3);
  if (red == "E-stop chain") {
    bench.script.estop_closed = false;
    bench.run_for(0.5);
  }
  bench.command(procedure_command_t::RESUME);
  bench.run_for(1);
  CHECK(bench.node->state().state == procedure_state_t::HELD);
  CHECK_FALSE(bench.precondition(red).met);
  CHECK(bench.event_text("command-refused").find("no resume: " + red) == 0);
  CHECK_FALSE(bench.testbed_received(testbed_command2_t::RESUME));

  bench.script.moved_on_hold_m = 0;
  bench.script.estop_closed = true;
  bench.run_for(0.5);
  bench.command(procedure_command_t::RESUME);
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.precondition(red).met);
}

TEST_CASE("a failed step waits for the operator when it is to") {
  fake::Script s;
  s.acquire_takes_s = 1000;
  EngineBench bench(s, procedure_of("  - acquire: {}\n    timeout: 3 s\n    on_failure: hold\n"
                                    "  - wait: 1 s\n"));
  bench.run_to(procedure_state_t::HELD);
  CHECK(bench.step("acquire").state == procedure_step_t::TIMEOUT);
  CHECK(bench.node->state().reason.find("Retry, skip or abort") != std::string::npos);
  bench.run_for(2);
  SECTION("it does not just go on") {
    bench.command(procedure_command_t::RESUME);
    bench.run_for(1);
    CHECK(bench.node->state().state == procedure_state_t::HELD);
    CHECK(bench.event_text("command-refused").find("has failed: retry, skip or abort") !=
          std::string::npos);
  }
  SECTION("retry") {
    bench.script.acquire_takes_s = 1;
    bench.command(procedure_command_t::RETRY);
    CHECK(bench.run() == procedure_state_t::PASS);
    CHECK(bench.step("acquire").attempts == 2);
    CHECK(bench.step("acquire").state == procedure_step_t::PASSED);
  }
  SECTION("skip") {
    bench.command(procedure_command_t::SKIP, "seen by eye");
    CHECK(bench.run() == procedure_state_t::PASS);
    CHECK(bench.step("acquire").state == procedure_step_t::SKIPPED);
    CHECK(bench.step("acquire").detail.find("seen by eye (step 'acquire' is not done") == 0);
  }
  SECTION("abort") {
    bench.command(procedure_command_t::ABORT, "enough");
    CHECK(bench.run() == procedure_state_t::ABORTED);
    CHECK(bench.step("acquire").state == procedure_step_t::TIMEOUT);
  }
}

TEST_CASE("a running step is tried again from its start") {
  fake::Script s;
  s.move_takes_s = 20;
  EngineBench bench(s, procedure_of("  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}\n"));
  bench.run_for(6);
  bench.script.move_takes_s = 2;
  bench.command(procedure_command_t::RETRY);
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.step("move").attempts == 2);
  int moves = 0;
  for (const auto& c : bench.testbed->obeyed) moves += c.command == testbed_command2_t::MOVE;
  CHECK(moves == 2);
}

TEST_CASE("between steps the next one can be skipped") {
  EngineBench bench({}, procedure_of("  - wait: 5 s\n    name: first\n"
                                     "  - wait: 5 s\n    name: second\n"
                                     "  - wait: 5 s\n    name: third\n"));
  bench.run_for(3);
  bench.command(procedure_command_t::STEP);
  bench.run_to(procedure_state_t::HELD);
  bench.run_for(1);
  bench.command(procedure_command_t::SKIP, "not today");
  bench.run_for(1);
  CHECK(bench.step("second").state == procedure_step_t::SKIPPED);
  CHECK(bench.node->state().state == procedure_state_t::HELD);
  bench.command(procedure_command_t::RESUME);
  CHECK(bench.run() == procedure_state_t::PASS);
  CHECK(bench.step("third").state == procedure_step_t::PASSED);
}

TEST_CASE("what cannot be done is refused with the reason") {
  EngineBench bench({}, procedure_of("  - wait: 20 s\n"));
  bench.run_for(3);
  const auto refused = [&bench](std::int8_t what, const std::string& text = "") {
    bench.events.clear();
    bench.command(what, text);
    bench.run_for(0.2);
    return bench.event_text("command-refused");
  };
  CHECK(refused(procedure_command_t::RESUME) == "no resume: nothing is held");
  CHECK(refused(procedure_command_t::RESET) == "no reset: nothing is held");
  CHECK(refused(procedure_command_t::SKIP) == "no skip: a reason is needed, for the record");
  CHECK(refused(procedure_command_t::ANSWER, "yes") == "no answer: no prompt is open");
  CHECK(refused(99) == "no command 99: it is not known");
  CHECK(refused(procedure_command_t::HOLD).empty());
  CHECK(refused(procedure_command_t::HOLD) == "no hold: it is held already");
  CHECK(bench.node->state().reason == "held by operator");
}
