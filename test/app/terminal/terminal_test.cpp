// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include "app/terminal/check_list.h"
#include "app/terminal/operator_keys.h"
#include "app/terminal/panel.h"
#include "app/terminal/progress.h"
#include "common/bus/loop.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::terminal;
using Catch::Matchers::Contains;

namespace {

procedure_state_t state_with(std::int8_t what) {
  procedure_state_t state{};
  state.procedure = "drill";
  state.state = what;
  state.outcome = procedure_state_t::NONE;
  state.utime_start = 100 * second;
  state.utime = 130 * second;
  state.current_step = 0;
  for (const char* name : {"first", "second", "third", "fourth"}) {
    procedure_step_t step{};
    step.name = name;
    step.attempts = 1;
    state.steps.push_back(step);
  }
  state.step_count = 4;
  state.steps[0].state = procedure_step_t::RUNNING;
  state.steps[0].utime_start = 118 * second;
  state.steps[0].detail = "62 %";
  return state;
}

procedure_state_t prompting(const std::string& id, const std::vector<std::string>& choices) {
  procedure_state_t state = state_with(procedure_state_t::PROMPTING);
  state.prompt_id = id;
  state.prompt = "Is the way clear?";
  state.utime_prompt_expires = 145 * second;
  state.choices = choices;
  state.choice_count = static_cast<std::int32_t>(choices.size());
  return state;
}

std::string text_of(const std::vector<Line>& lines) {
  std::string text;
  for (const Line& line : lines) text += line.rendered(false) + "\n";
  return text;
}

struct Keyboard {
  std::vector<procedure_command_t> sent;
  OperatorKeys keys;
  explicit Keyboard(bool observing = false)
      : keys([this](const procedure_command_t& c) { sent.push_back(c); }, observing) {}
  void type(const std::string& text) {
    for (const char c : text) keys.type(c);
  }
};

}  // namespace

TEST_CASE("each key requests its command, abort at once and as often as it is struck") {
  Keyboard keyboard;
  keyboard.keys.on(state_with(procedure_state_t::RUNNING));
  keyboard.type("hrntaax");
  REQUIRE(keyboard.sent.size() == 7);
  CHECK(keyboard.sent[0].command == procedure_command_t::HOLD);
  CHECK(keyboard.sent[1].command == procedure_command_t::RESUME);
  CHECK(keyboard.sent[2].command == procedure_command_t::STEP);
  CHECK(keyboard.sent[3].command == procedure_command_t::RETRY);
  CHECK(keyboard.sent[4].command == procedure_command_t::ABORT);
  CHECK(keyboard.sent[5].command == procedure_command_t::ABORT);
  CHECK(keyboard.sent[6].command == procedure_command_t::RESET);
  keyboard.type("wyz \n");
  CHECK(keyboard.sent.size() == 7);
  CHECK_FALSE(keyboard.keys.leaves());
  keyboard.type("q");
  CHECK(keyboard.keys.leaves());
}

TEST_CASE("a skip prompts for its reason and is not sent without one") {
  Keyboard keyboard;
  keyboard.keys.on(state_with(procedure_state_t::RUNNING));
  keyboard.type("s\n");
  CHECK(keyboard.sent.empty());
  CHECK_THAT(text_of(keyboard.keys.lines()), Contains("needs a reason"));
  keyboard.type(
      "lamp bright\x7f\x7f\x7f\x7f\x7f\x7f"
      "broken\n");
  REQUIRE(keyboard.sent.size() == 1);
  CHECK(keyboard.sent[0].command == procedure_command_t::SKIP);
  CHECK(keyboard.sent[0].text == "lamp broken");
  keyboard.type("swhy\x1b");
  keyboard.type("h");
  REQUIRE(keyboard.sent.size() == 2);
  CHECK(keyboard.sent[1].command == procedure_command_t::HOLD);
}

TEST_CASE("a prompt takes the keys for its answer; Escape gives them back") {
  Keyboard keyboard;
  keyboard.keys.on(prompting("clear", {"yes", "no", "not yet"}));
  keyboard.type("n\n");  // two choices begin so
  CHECK(keyboard.sent.empty());
  CHECK_THAT(text_of(keyboard.keys.lines()), Contains("[yes / no / not yet]"));
  keyboard.type("\x15Y\n");
  REQUIRE(keyboard.sent.size() == 1);
  CHECK(keyboard.sent[0].command == procedure_command_t::ANSWER);
  CHECK(keyboard.sent[0].prompt_id == "clear");
  CHECK(keyboard.sent[0].text == "yes");

  keyboard.keys.on(state_with(procedure_state_t::RUNNING));
  keyboard.keys.on(prompting("serial", {}));
  keyboard.type(
      "\x1b"
      "a");
  REQUIRE(keyboard.sent.size() == 2);
  CHECK(keyboard.sent[1].command == procedure_command_t::ABORT);
  keyboard.type("\nha 7\n");
  REQUIRE(keyboard.sent.size() == 3);
  CHECK(keyboard.sent[2].text == "ha 7");
  // a prompt whose time is up gives the keys back
  keyboard.keys.on(prompting("again", {}));
  keyboard.keys.on(state_with(procedure_state_t::RUNNING));
  keyboard.type("h");
  CHECK(keyboard.sent.back().command == procedure_command_t::HOLD);
}

TEST_CASE("an observer sends nothing") {
  Keyboard keyboard(true);
  keyboard.keys.on(prompting("clear", {"yes"}));
  keyboard.type("y\nhrnsta\n");
  CHECK(keyboard.sent.empty());
  CHECK_THAT(text_of(keyboard.keys.lines()), Contains("only observing"));
  keyboard.type("\x04");
  CHECK(keyboard.keys.leaves());
}

TEST_CASE("the panel shows step, time, next step, limits with margins, and the prompt") {
  procedure_state_t state = prompting("clear", {"yes", "no"});
  criterion_result_t limit{};
  limit.name = "never too near";
  limit.unit = "m";
  limit.value = 3.71;
  limit.lower_limit = 3;
  limit.upper_limit = std::numeric_limits<double>::infinity();
  state.limits = {limit};
  state.limit_count = 1;
  const std::string text = text_of(panel(state));
  INFO(text);
  CHECK_THAT(text, Contains("drill  WAITS FOR AN ANSWER  30.0 s  step 1 of 4"));
  CHECK_THAT(text, Contains("> first") && Contains("12.0 s") && Contains("62 %"));
  CHECK_THAT(text, Contains("third") && !Contains("fourth"));
  CHECK_THAT(text, Contains("limit never too near") && Contains("margin 0.710"));
  CHECK_THAT(text, Contains("? Is the way clear? [yes / no]") && Contains("15.0 s left"));
  for (const Line& line : panel(state)) CHECK(line.width() <= 100);
}

TEST_CASE("control is taken and given back by one key, and taken over only by a second stroke") {
  std::vector<procedure_command_t> sent;
  OperatorKeys keys([&sent](const procedure_command_t& c) { sent.push_back(c); }, false, "me");
  keys.on(state_with(procedure_state_t::RUNNING));
  const auto held_by = [&keys](const std::string& name) {
    operator_control_t control{};
    control.holder = name;
    keys.on(control);
  };
  keys.type('c');
  REQUIRE(sent.size() == 1);
  CHECK(sent[0].command == procedure_command_t::TAKE_CONTROL);
  CHECK(sent[0].text.empty());
  CHECK_FALSE(keys.has_control());
  held_by("me");
  CHECK(keys.has_control());
  keys.type('c');
  REQUIRE(sent.size() == 2);
  CHECK(sent[1].command == procedure_command_t::RELEASE_CONTROL);
  held_by("alice");
  keys.type('c');
  CHECK(sent.size() == 2);
  CHECK_THAT(text_of(keys.lines()), Contains("alice has control: once more takes it over"));
  held_by("bob");
  keys.type('c');  // another holder than the operator was shown
  CHECK(sent.size() == 2);
  keys.type('c');
  REQUIRE(sent.size() == 3);
  CHECK(sent[2].text == "take over");
}

TEST_CASE("what the engine refuses is shown with its reason, whatever events are lost") {
  Keyboard keyboard;
  keyboard.keys.on(state_with(procedure_state_t::RUNNING));
  keyboard.type("n");
  CHECK_THAT(text_of(keyboard.keys.lines()), Contains("step requested"));
  keyboard.keys.on_answer(CommandStatus::accepted, "");
  CHECK_THAT(text_of(keyboard.keys.lines()), !Contains("requested"));
  keyboard.type("r");
  keyboard.keys.on_answer(CommandStatus::refused, "nothing is held");
  CHECK_THAT(text_of(keyboard.keys.lines()), Contains("refused: nothing is held"));
  keyboard.keys.on_answer(CommandStatus::unanswered, "no answer within 2.0 s");
  CHECK_THAT(text_of(keyboard.keys.lines()), Contains("no answer within 2.0 s"));
}

TEST_CASE("the speed goes up and down by tenths, within 10 to 100 percent") {
  std::vector<std::string> speeds;
  OperatorKeys keys([&speeds](const procedure_command_t& c) { speeds.push_back(c.text); }, false);
  keys.on(state_with(procedure_state_t::RUNNING));
  testbed_state_t testbed{};
  testbed.speed_override = 0.3;
  keys.on(testbed);
  for (const char key : {'-', '-', '-', '+'}) keys.type(key);
  CHECK(speeds == std::vector<std::string>{"20 %", "10 %", "10 %", "20 %"});
  testbed.speed_override = 1;
  keys.on(testbed);
  keys.type('+');
  CHECK(speeds.back() == "100 %");
}

namespace {

void add(procedure_state_t& state, const char* name, bool met, const char* reason) {
  precondition_t precondition{};
  precondition.name = name;
  precondition.met = met;
  precondition.reason = reason;
  state.preconditions.push_back(precondition);
  state.precondition_count = static_cast<std::int32_t>(state.preconditions.size());
}

procedure_state_t preparing() {
  procedure_state_t state = state_with(procedure_state_t::PREPARING);
  state.current_step = -1;
  state.utime = state.utime_start;
  state.steps.clear();
  add(state, "node estimator", true, "READY");
  add(state, "node lidar-driver", false, "nothing received");
  add(state, "fence", false, "open");
  return state;
}

}  // namespace

TEST_CASE("what is waited for is one line of the panel; while held what stands in the way") {
  procedure_state_t state = preparing();
  state.reason =
      "waiting for arm-driver-replica, arm-driver-sensor, facility-driver, lidar-driver, "
      "testbed";
  const std::string text = text_of(panel(state));
  CHECK_THAT(text, Contains("waiting for arm-driver-replica") && Contains("lidar-driver"));
  CHECK_THAT(text, !Contains("BAD") && !Contains("READY"));
  for (const Line& line : panel(state)) CHECK(line.width() <= 79);
  state.state = procedure_state_t::HELD;
  CHECK_THAT(text_of(panel(state)), Contains("BAD  fence") && !Contains("estimator"));
}

TEST_CASE("without a panel the preconditions take a line while waited for, and one when met") {
  std::vector<std::string> lines;
  Progress progress([&lines](const Line& line) { lines.push_back(line.rendered(false)); });
  procedure_state_t state = preparing();
  // nodes come one by one, within seconds
  for (const char* left : {"a, b, c", "b, c", "c"}) {
    state.reason = std::string("waiting for ") + left;
    progress.on(state);
    state.utime += second;
  }
  CHECK(lines == std::vector<std::string>{"    0.0 s  waiting for a, b, c"});
  SECTION("repeated where it takes long") {
    for (int i = 0; i < 25; ++i) {
      progress.on(state);
      state.utime += second;
    }
    CHECK(lines.size() == 2);
    CHECK_THAT(lines.back(), Contains("waiting for c"));
  }
  SECTION("met") {
    state.state = procedure_state_t::RUNNING;
    state.reason.clear();
    for (precondition_t& p : state.preconditions) p.met = true;
    progress.on(state);
    progress.on(state);
    REQUIRE(lines.size() == 2);
    CHECK_THAT(lines[1], Contains("ready") && Contains("2 nodes, fence"));
  }
  SECTION("never met: only the missing conditions are reported") {
    state.state = procedure_state_t::FINISHED;
    progress.on(state);
    REQUIRE(lines.size() == 3);
    CHECK_THAT(lines[1], Contains("BAD") && Contains("lidar-driver"));
    CHECK_THAT(lines[2], Contains("BAD") && Contains("fence") && Contains("open"));
  }
}

TEST_CASE("lasting lines report steps once, prompts once, and holds") {
  std::vector<std::string> lines;
  Progress progress([&lines](const Line& line) { lines.push_back(line.rendered(false)); });
  procedure_state_t state = state_with(procedure_state_t::RUNNING);
  progress.on(state);
  state.steps[0].state = procedure_step_t::PASSED;
  state.steps[0].utime_end = 130 * second;
  progress.on(state);
  progress.on(state);
  REQUIRE(lines.size() == 1);
  CHECK(lines[0] == "   30.0 s  done     first  (12.0 s)  62 %");
  procedure_state_t prompted = prompting("clear", {"yes", "no"});
  prompted.steps = state.steps;
  progress.on(prompted);
  prompted.utime += second;
  progress.on(prompted);
  REQUIRE(lines.size() == 2);
  CHECK_THAT(lines[1], Contains("prompt  ") && Contains("[yes / no]") && Contains("prompt clear"));
  state.state = procedure_state_t::HELD;
  progress.on(state);
  REQUIRE(lines.size() == 3);
  CHECK_THAT(lines[2], Contains("HELD"));
}

TEST_CASE("lines are cut by characters, and coloured only where requested") {
  Line line("rote ", Style::bad);
  line.add("Größe").tab(14).add("x");
  CHECK(line.width() == 15);
  CHECK(line.rendered(false) == "rote Größe    x");
  CHECK(line.rendered(false, 8) == "rote Grö");
  CHECK(line.rendered(true, 4) == "\x1b[1;31mrote\x1b[0m");
  for (const std::string& part : wrapped("one two three four", 9)) CHECK(part.size() <= 9);
  CHECK(text_of_duration(99.94) == "99.9 s");
  CHECK(text_of_duration(125) == "2 min 05 s");
  CHECK(text_of_duration(2 * 3600 + 180) == "2 h 03 min");
}

TEST_CASE("the list of a check fits 100 columns and has errors below their step") {
  procedures::CheckReport report;
  report.file = "p.yaml";
  report.name = "p";
  report.layout = "range";
  report.target = "radarsat2";
  procedures::StepForecast step;
  step.name = "a step of a name that is far too long for one column";
  step.line = 7;
  step.moves = true;
  step.duration = 7200;
  step.clearance = 0.43;
  step.near_a = "replica arm's pedestal";
  step.near_b = "sensor arm's upper arm";
  step.joint = "replica J5";
  step.joint_margin = 0.5;
  report.steps = {step};
  report.main_steps = 1;
  report.findings = {{procedures::Severity::error, "p.yaml", 7, "step 'a'",
                      "the testbed refuses: " + std::string(20, 'x') + " " + std::string(70, 'y'),
                      "something else", 0}};
  const auto lines = check_list(report, 100);
  for (const Line& line : lines) CHECK(line.width() <= 100);
  const std::string text = text_of(lines);
  INFO(text);
  CHECK_THAT(text,
             Contains("BAD    7") && Contains("error: the testbed refuses") && Contains("1 error"));
}
