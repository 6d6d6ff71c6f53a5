// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/core/error.h"
#include "procedures/language/procedure.h"
#include "test/catch.h"
#include "test/procedures/language/parsed.h"

using namespace berth;
using namespace berth::procedures;

namespace {

namespace fs = std::filesystem;

std::vector<std::string> names(const Procedure& procedure) {
  std::vector<std::string> list;
  for (const Step& step : procedure.steps) list.push_back(step.name);
  return list;
}

/// Procedures in a folder of their own.
class Folder {
 public:
  Folder() { fs::create_directories(path / "parts"); }
  ~Folder() { fs::remove_all(path); }
  void put(const char* name, const std::string& text) { std::ofstream(path / name) << text; }
  Procedure load(const Overrides& overrides = {}) {
    return load_procedure(path / "main.yaml", overrides);
  }
  std::string load_error() {
    try {
      load();
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  }

  fs::path path = fs::temp_directory_path() / ("berth-language-" + std::to_string(::getpid()));
};

}  // namespace

TEST_CASE("a repeat is unrolled") {
  const Procedure p = parsed_steps(
      "  - repeat:\n"
      "      times: 2\n"
      "      steps:\n"
      "        - wait: 1 s\n"
      "        - wait: 2 s\n"
      "          name: longer\n"
      "  - wait: 3 s\n");
  CHECK(names(p) ==
        std::vector<std::string>{"wait (1 of 2)", "longer", "wait (2 of 2)", "longer", "wait"});
  CHECK(p.steps[0].depth == 1);
  CHECK(p.steps[4].depth == 0);
  CHECK(p.steps[2].line == 6);
  CHECK(p.steps[3].phase == "wait");
}

TEST_CASE("a sweep runs over a grid, with units, ranges and poses") {
  const Procedure p = parsed_steps(
      "  - sweep:\n"
      "      far: {from: 5 m, to: 4.4 m, step: 0.3 m}\n"
      "      turn: [0, 10.5]\n"
      "      steps:\n"
      "        - move: {to: [0, 0, 5000, 0, 0, ${turn}], speed: 50 mm/s}\n"
      "          phase: at ${far}\n"
      "  - sweep:\n"
      "      pose: [[0, 0, 5000, 0, 0, 0], [1, 2, 4000, 0, 0, 0]]\n"
      "      steps:\n"
      "        - move: {to: \"${pose}\", speed: 50 mm/s}\n"
      "          name: to ${pose}\n");
  REQUIRE(p.steps.size() == 8);
  CHECK(p.steps[0].name == "move (far 5 m, turn 0)");
  CHECK(p.steps[1].name == "move (far 5 m, turn 10.5)");
  CHECK(p.steps[1].phase == "at 5 m");
  CHECK(p.steps[5].phase == "at 4.4 m");
  CHECK(degrees(angle_between(Pose{}, std::get<Move>(p.steps[1].verb).to)) == Approx(10.5));
  CHECK(p.steps[5].line == 7);
  CHECK(std::get<Move>(p.steps[7].verb).to.position.z() == Approx(4));
  CHECK(p.steps[7].name == "to [1, 2, 4000, 0, 0, 0]");
}

TEST_CASE("blocks nest, and a block's keys hold for its steps") {
  const Procedure p = parsed_steps(
      "  - sweep:\n"
      "      speed: [1 mm/s, 2 mm/s]\n"
      "      steps:\n"
      "        - repeat:\n"
      "            times: 2\n"
      "            steps:\n"
      "              - move: {to: [0, 0, 5000, 0, 0, 0], speed: \"${speed}\"}\n"
      "              - wait: 1 s\n"
      "                phase: own\n"
      "                on_failure: hold\n"
      "          if: estimate is ok\n"
      "    phase: survey\n"
      "    on_failure: retry 2 times, then continue\n");
  REQUIRE(p.steps.size() == 8);
  CHECK(p.steps[6].name == "move (speed 2 mm/s, 2 of 2)");
  CHECK(std::get<Move>(p.steps[6].verb).speed == Approx(0.002));
  CHECK(p.steps[6].depth == 2);
  CHECK(p.steps[6].phase == "survey");
  CHECK(p.steps[6].on_failure.retries == 2);
  CHECK(p.steps[6].on_failure.then == OnFailure::Then::go_on);
  CHECK(p.steps[7].phase == "own");
  CHECK(p.steps[7].on_failure.then == OnFailure::Then::hold);
  CHECK(p.steps[7].on_failure.retries == 0);
  // Asked once for the block, for each value of the sweep.
  REQUIRE(p.steps[4].gates.size() == 1);
  CHECK(p.steps[4].gates[0].steps == 4);
  CHECK(p.steps[5].gates.empty());
}

TEST_CASE("names of sweeps are checked") {
  const std::string inside =
      "  - sweep:\n      a: [1 s]\n      steps:\n        - wait: ${b}\n  - wait: 1 s\n";
  CHECK(error_of_steps(inside) == "p.yaml:6: parameter 'b' is not defined; the procedure has none");
  CHECK(error_of_steps("  - sweep:\n      a: [1 s]\n      steps:\n        - wait: ${a}\n"
                       "  - wait: ${a}\n") ==
        "p.yaml:7: 'a' has no value here: it belongs to a sweep elsewhere");
  CHECK(error_of_steps("  - sweep:\n      a: []\n      steps:\n        - wait: 1 s\n")
            .find("p.yaml:4: key 'steps[0].sweep.a': expected a list of values") == 0);
  CHECK(error_of_steps("  - sweep:\n      a: {from: 1 s, to: 2 m, step: 1 s}\n      steps:\n"
                       "        - wait: 1 s\n")
            .find("p.yaml:4: key 'steps[0].sweep.a.to': found '2 m', expected a time") == 0);
  CHECK(error_of_steps("  - sweep:\n      a: {from: 2 s, to: 1 s, step: -1 s}\n"
                       "      steps:\n        - wait: ${a}\n")
            .find("p.yaml:4: key 'steps[0].sweep.a.step': found '-1 s', expected a time above 0") ==
        0);
  CHECK(error_of_steps("  - sweep:\n      a: [1 s, 2 m]\n      steps:\n        - wait: ${a}\n")
            .find("p.yaml:6: key 'steps[0].sweep.steps[0].wait': found '2 m'") == 0);
  try {
    parse_procedure(
        "name: t\nparameters:\n  a: 1 s\nsteps:\n  - sweep:\n      a: [2 s]\n      steps:\n"
        "        - wait: ${a}\n",
        "p.yaml");
    FAIL("a parameter and a sweep of one name");
  } catch (const InputError& e) {
    CHECK(std::string(e.what()).find("'a' is the name of a parameter and of a sweep") !=
          std::string::npos);
  }
}

TEST_CASE("there is a limit to the steps that one message can hold") {
  CHECK(error_of_steps("  - repeat:\n      times: 400\n      steps:\n        - wait: 1 s\n"
                       "        - wait: 1 s\n") == "p.yaml:6: more than 400 steps");
  const std::string name(100, 'n');
  CHECK(error_of_steps("  - repeat:\n      times: 390\n      steps:\n        - wait: 1 s\n"
                       "          name: " +
                       name + "\n")
            .find("with short names") != std::string::npos);
}

TEST_CASE("a calibration is motions and waits at rest, the waits in its phase") {
  const Procedure p = parsed_steps(
      "  - acquire: {}\n"
      "  - calibrate:\n"
      "      poses: [[0, 0, 5000, 0, 0, 0], [0, 0, 5000, 10, 0, 0]]\n"
      "      estimates: 12\n"
      "      speed: 100 mm/s\n");
  REQUIRE(p.steps.size() == 7);
  CHECK(p.steps[4].name == "move (pose 2 of 2)");
  CHECK(p.steps[4].phase == "calibrate motion");
  CHECK(p.steps[4].when_lost == WhenLost::ignore);
  CHECK(std::get<Track>(p.steps[5].verb).from->position.z() == Approx(5));
  CHECK(p.steps[5].gates[0].condition.text == "estimate is not ok");
  CHECK(p.steps[6].phase == "calibrate");
  CHECK(p.steps[6].when_lost == WhenLost::skip);
  CHECK(std::get<Dwell>(p.steps[6].verb).estimates == 12);
  CHECK(error_of_steps("  - calibrate: {poses: [[0, 0, 5000, 0, 0, 0]], speed: 1 mm/s}\n")
            .find("needs an 'acquire' before it") != std::string::npos);
}

TEST_CASE("an arm can be frozen, in a move and on the way to each calibration pose") {
  const Procedure p = parsed_steps(
      "  - acquire: {}\n"
      "  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 1 mm/s, frozen: sensor}\n"
      "  - calibrate:\n"
      "      poses: [[0, 0, 5000, 0, 0, 0], [0, 0, 5000, 10, 0, 0]]\n"
      "      frozen: [replica, none]\n"
      "      speed: 100 mm/s\n");
  CHECK(std::get<Move>(p.steps[1].verb).frozen_arm == 2);
  CHECK(std::get<Move>(p.steps[2].verb).frozen_arm == 1);
  CHECK(std::get<Move>(p.steps[5].verb).frozen_arm == 0);
  const std::string start =
      "  - acquire: {}\n  - calibrate: {poses: [[0, 0, 5000, 0, 0, 0]], speed: 1 mm/s, frozen: ";
  CHECK(error_of_steps(start + "[left]}\n").find("found 'left'") != std::string::npos);
  CHECK(error_of_steps(start + "[none, none]}\n").find("found 2 arms") != std::string::npos);
}

TEST_CASE("the other verbs are read") {
  const Procedure p = parsed_steps(
      "  - prompt: {text: Ready for it, choices: [go, no], go_on: [go], default: go}\n"
      "    timeout: 2 min\n"
      "  - prompt: What do you see\n"
      "  - record: surface_range\n"
      "  - record: {value: position_error, name: at the start}\n"
      "  - inject: {device: lidar, fault: range_bias, value: 30 mm, for: 5 s}\n"
      "  - clear_injections: {device: lidar, fault: range_bias}\n"
      "  - clear_injections:\n"
      "  - wait_until: estimated_range < 4 m and estimate is ok for 1 s\n");
  CHECK(std::get<Prompt>(p.steps[0].verb).go_on == std::vector<std::string>{"go"});
  CHECK(p.steps[0].timeout == 120);
  CHECK(std::get<Prompt>(p.steps[1].verb).choices.empty());
  CHECK(std::get<procedures::Record>(p.steps[3].verb).name == "at the start");
  const auto& inject = std::get<Inject>(p.steps[4].verb);
  CHECK(inject.value == Approx(0.03));
  CHECK(inject.duration == 5);
  CHECK(std::get<ClearInjections>(p.steps[6].verb).device.empty());
  const auto& condition = std::get<WaitUntil>(p.steps[7].verb).condition;
  REQUIRE(condition.clauses.size() == 2);
  CHECK(condition.clauses[0].value == 4);
  CHECK(condition.duration == 1);
  // What was injected ends with the run.
  CHECK(std::holds_alternative<ClearInjections>(p.teardown[0].verb));
}

TEST_CASE("unknown faults are refused, with the list of known ones") {
  const auto error_about = [](const std::string& fault) {
    return error_of_steps("  - inject: {" + fault + "}\n");
  };
  CHECK(error_about("device: lidar, fault: explode").find("range_bias") != std::string::npos);
  CHECK(error_about("device: radar, fault: silent").find("arm-replica") != std::string::npos);
  CHECK(error_about("device: lidar, fault: range_bias, value: 3 s").find("length") !=
        std::string::npos);
  CHECK(error_about("device: lidar, fault: dropout, value: 120 %").find("100 %") !=
        std::string::npos);
  CHECK(error_about("device: plc, fault: estop, value: 1").find("takes no value") !=
        std::string::npos);
  CHECK(error_of_steps("  - clear_injections: {device: lidar, fault: explode}\n").find("explode") !=
        std::string::npos);
}

TEST_CASE("conditions without meaning are refused, with the expected form") {
  const auto wrong = [](const std::string& text) {
    return error_of_steps("  - wait_until: " + text + "\n");
  };
  const std::string place = "p.yaml:3: key 'steps[0].wait_until': ";
  CHECK(wrong("range < 4 m").find(place + "found 'range', expected one of: estimate, ") == 0);
  CHECK(wrong("estimated_range < 4 s").find(place + "found '4 s', expected a length") == 0);
  CHECK(wrong("estimate < 4") ==
        place + "found 'estimate < 4', but estimate is a state: expected 'is' or 'is not'");
  CHECK(wrong("estimate is good").find("but estimate is one of: idle, acquiring, ok") !=
        std::string::npos);
  CHECK(wrong("clearance").find("expected a condition such as") != std::string::npos);
  CHECK(wrong("clearance > 1 m and estimate is ok or estimate is lost")
            .find("either 'and' or 'or'") != std::string::npos);
  CHECK(error_of_steps("  - wait: 1 s\n    if: estimate is ok for 2 s\n")
            .find("p.yaml:4: key 'steps[0].if'") == 0);
  CHECK(error_of_steps("  - wait: 1 s\n    on_failure: try again\n")
            .find("p.yaml:4: key 'steps[0].on_failure': found 'try again'") == 0);
}

TEST_CASE("limits name what they watch") {
  const std::string steps = "name: t\nsteps:\n  - wait: 1 s\n    phase: still\n";
  const auto wrong = [&](const std::string& limit) {
    try {
      parse_procedure(steps + "limits:\n  - {name: near, " + limit + "}\n", "p.yaml");
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const Procedure p = parse_procedure(
      steps + "limits:\n  - {name: near, watch: surface_range, min: 3 m, phase: still, for: 1 s}\n",
      "p.yaml");
  REQUIRE(p.limits.size() == 1);
  CHECK(p.limits[0].lower == 3);
  CHECK(p.limits[0].then == Limit::Then::fail);
  CHECK(wrong("watch: surface, min: 3 m").find("p.yaml:6: key 'limits[0].watch'") == 0);
  CHECK(wrong("watch: surface_range, min: 3 s").find("expected a length") != std::string::npos);
  CHECK(wrong("watch: estimate, min: 1").find("is a state") != std::string::npos);
  CHECK(wrong("watch: clearance").find("needs 'min' or 'max'") != std::string::npos);
  CHECK(wrong("watch: clearance, min: 1 m, then: stop").find("one of: fail, abort, hold") !=
        std::string::npos);
  CHECK(wrong("watch: clearance, min: 1 m, phase: moving")
            .find("found phase 'moving', expected one of: run, still") != std::string::npos);
}

TEST_CASE("a procedure calls another with its parameters, and its text stands alone") {
  Folder folder;
  folder.put("main.yaml",
             "name: main\nparameters:\n  pause: 2 s\nsteps:\n"
             "  - call: {procedure: parts/look.yaml, with: {time: \"${pause}\"}}\n"
             "  - call: parts/look.yaml\n"
             "    phase: again\n");
  folder.put("parts/look.yaml",
             "name: look\nparameters:\n  time: 1 s   # of the wait\nsteps:\n"
             "  - wait: ${time}\n  - call: nod.yaml\n"
             "limits:\n  - {name: wide, watch: clearance, min: 0.1 m}\n"
             "criteria:\n  - {name: its own, measurement: duration, min: 0 s}\n");
  folder.put("parts/nod.yaml", "name: nod\nsteps:\n  - annotate: 'yes: indeed ${not_mine'\n");
  const Procedure p = folder.load({{"pause", "3 s"}});
  REQUIRE(p.steps.size() == 4);
  CHECK(std::get<Wait>(p.steps[0].verb).duration == 3);
  CHECK(std::get<Wait>(p.steps[2].verb).duration == 1);
  CHECK(p.steps[2].phase == "again");
  CHECK(p.steps[1].depth == 2);
  CHECK(p.steps[1].file == (folder.path / "parts/nod.yaml").string());
  CHECK(p.criteria.empty());
  REQUIRE(p.limits.size() == 2);
  CHECK(p.limits[1].first_step == 2);
  CHECK(p.limits[1].last_step == 3);

  // Nothing but the text is needed any more.
  fs::remove_all(folder.path / "parts");
  const Procedure again = parse_procedure(p.text, "elsewhere/procedure.yaml");
  CHECK(names(again) == names(p));
  CHECK(std::get<Wait>(again.steps[0].verb).duration == 3);
  CHECK(again.text == p.text);
}

TEST_CASE("a trajectory's file goes with the procedure: its text alone flies the same") {
  Folder folder;
  folder.put("main.yaml", "name: main\nsteps:\n  - trajectory: {file: {name: parts/t.csv}}\n");
  folder.put("parts/t.csv", "# mine\nt,x,y,z,w,p,r\n0,100,0,5000,5,10,-5\n5,100,0,4900,5,10,-5\n");
  const Procedure p = load_procedure(folder.path / "main.yaml", {});
  const auto end = [](const Procedure& procedure) {
    return std::get<Trajectory>(procedure.steps.front().verb).waypoints(Pose{}).back();
  };
  std::filesystem::remove(folder.path / "parts/t.csv");
  CHECK(folder.load_error().find("cannot be read") != std::string::npos);
  const Procedure again = parse_procedure(p.text, "elsewhere/procedure.yaml", {});
  CHECK(end(again).pose.position.z() == Approx(4.9));
  CHECK(end(again).time == end(p).time);
  CHECK(again.text == p.text);
}

TEST_CASE("errors in a called procedure name its line and the caller's") {
  Folder folder;
  const std::string main = (folder.path / "main.yaml").string();
  const std::string part = (folder.path / "parts/a.yaml").string();
  folder.put("main.yaml", "name: main\nsteps:\n  - wait: 1 s\n  - call: parts/a.yaml\n");
  CHECK(folder.load_error().find(main + ":4: key 'steps[1].call': ") == 0);
  folder.put("parts/a.yaml", "name: a\nsteps:\n  - wait: 1 m\n");
  CHECK(folder.load_error() == part +
                                   ":3: key 'steps[0].wait': found '1 m', expected a time such as "
                                   "'10 s' or '150 ms'\n  called from " +
                                   main + ":4");
  folder.put("parts/a.yaml", "name: a\nsteps:\n  - call: ../main.yaml\n");
  CHECK(folder.load_error().find("call itself without end") != std::string::npos);
  folder.put("parts/a.yaml", "name: a\nstepps:\n  - wait: 1 s\n");
  CHECK(folder.load_error().find(part + ":1: key 'steps': is missing") == 0);
  folder.put("main.yaml",
             "name: main\nsteps:\n  - call: {procedure: parts/a.yaml, with: {speed: 1 m}}\n");
  folder.put("parts/a.yaml", "name: a\nparameters:\n  time: 1 s\nsteps:\n  - wait: ${time}\n");
  CHECK(folder.load_error().find("no parameter 'speed'; there are: time") != std::string::npos);
}

TEST_CASE("a procedure's figures name phases that it has") {
  const auto with_phase = [](const std::string& phase) {
    return "  - wait: 1 s\n    phase: still\nsource: a paper\nfigures:\n  - name: Figure 1\n    "
           "charts:\n"
           "      - {draw: [position_error], phase: " +
           phase + "}\n";
  };
  const Procedure procedure = parsed_steps(with_phase("still"));
  CHECK(procedure.source == "a paper");
  REQUIRE(procedure.figures.size() == 1);
  CHECK(error_of_steps(with_phase("run")).empty());
  CHECK(error_of_steps(with_phase("stil"))
            .find("p.yaml:9: key 'figures': figure 'Figure 1': found phase 'stil', expected one "
                  "of: run, "
                  "still") == 0);
}
