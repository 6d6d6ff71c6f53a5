// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/procedure.h"

#include <filesystem>

#include "common/core/error.h"
#include "test/catch.h"
#include "test/procedures/language/parsed.h"

using namespace berth;
using namespace berth::procedures;

namespace {

const char* const good = R"(name: good
parameters:
  speed: 20 mm/s    # of the approach
  start: [0, 0, 5000, 0, 0, 90]
steps:
  - move: {to: ${start}, speed: 0.1 m/s}
  - acquire: {gate: [3 m, 8 m], returns: 3000}
    timeout: 45 s
  - approach: {standoff: 3.2 m, speed: ${speed}}
    name: fly in
    phase: final
  - hold: 10 s
  - wait: 500 ms
  - annotate: all is well   # a remark
criteria:
  - {name: position, measurement: position_error, statistic: rms, phase: final, max: 20 mm}
  - {name: share, measurement: tracking_share, min: 95 %}
)";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("a procedure is read with its units") {
  const Procedure p = parse_procedure(good, "p.yaml");
  REQUIRE(p.steps.size() == 6);
  const auto& move = std::get<Move>(p.steps[0].verb);
  CHECK(move.speed == Approx(0.1));
  CHECK(move.to.position.z() == Approx(5.0));
  CHECK(degrees(angle_between(Pose{}, move.to)) == Approx(90));
  const auto& acquire = std::get<Acquire>(p.steps[1].verb);
  CHECK(acquire.gate_far == 8);
  CHECK(acquire.returns == 3000);
  CHECK(p.steps[1].timeout == 45);
  CHECK(p.steps[1].phase == "acquire");
  CHECK(std::get<Approach>(p.steps[2].verb).speed == Approx(0.02));
  CHECK(p.steps[2].name == "fly in");
  CHECK(p.steps[2].phase == "final");
  CHECK(std::get<Wait>(p.steps[4].verb).duration == Approx(0.5));
  CHECK(std::get<Annotate>(p.steps[5].verb).text == "all is well");
  REQUIRE(p.criteria.size() == 2);
  CHECK(p.criteria[0].upper == Approx(0.02));
  CHECK(p.criteria[1].lower == Approx(0.95));
  CHECK(p.criteria[1].phase == "run");
}

TEST_CASE("a procedure without a teardown stops tracking and switches the lamps off") {
  const Procedure p = parse_procedure(good, "p.yaml");
  REQUIRE(p.teardown.size() == 2);
  CHECK(std::holds_alternative<StopTracking>(p.teardown[0].verb));
  CHECK(std::get<Lights>(p.teardown[1].verb).sun == 0);
  CHECK(p.teardown[0].phase == evaluation::teardown_phase);
}

TEST_CASE("parameters are overridden, and the text as run has them") {
  const Procedure p =
      parse_procedure(good, "p.yaml", {{"speed", "3 cm/s"}, {"start", "[1, 2, 4000, 0, 0, 0]"}});
  CHECK(std::get<Approach>(p.steps[2].verb).speed == Approx(0.03));
  CHECK(std::get<Move>(p.steps[0].verb).to.position.z() == Approx(4));
  CHECK(p.text.find("speed: 3 cm/s    # of the approach") != std::string::npos);
  CHECK(p.text.find("${") == std::string::npos);
  // The text as run is a procedure of its own, and the same one.
  const Procedure again = parse_procedure(p.text, "again.yaml", {{"speed", "3 cm/s"}});
  CHECK(std::get<Approach>(again.steps[2].verb).speed == Approx(0.03));
  CHECK(again.text == p.text);
  CHECK(error_of(p.text, {{"speed", "4 cm/s"}}).find("as it was run") != std::string::npos);
}

TEST_CASE("overrides that do not fit are refused") {
  CHECK(error_of(good, {{"speeed", "1 mm/s"}}) ==
        "p.yaml: no parameter 'speeed'; there are: speed, start");
  CHECK(error_of(good, {{"speed", "30 mm"}}) ==
        "parameter 'speed': found '30 mm', expected a speed such as '20 mm/s'");
  CHECK(error_of(good, {{"start", "[1, 2]"}}).find("expected a list such as") != std::string::npos);
  CHECK(error_of(good, {{"speed", "1 mm/s, standoff: 0 m"}}) ==
        "parameter 'speed': found '1 mm/s, standoff: 0 m', expected a speed such as '20 mm/s'");
}

TEST_CASE("errors name file, line, key and what was expected") {
  const auto with = [](const std::string& from, const std::string& to) {
    return error_of(replaced(good, from, to));
  };
  CHECK(with("standoff: 3.2 m", "standoff: 3.2 s") ==
        "p.yaml:9: key 'steps[2].approach.standoff': found '3.2 s', expected a length such as "
        "'5.5 m' or '30 mm'");
  CHECK(with("standoff:", "standof:").find("p.yaml:9: key 'steps[2].approach.standoff'") == 0);
  CHECK(with("  - acquire", "  - aquire").find("p.yaml:7: key 'steps[1].aquire': is no step") == 0);
  CHECK(with("    timeout: 45 s", "    timeout: 45 m").find("p.yaml:8: key 'steps[1].timeout'") ==
        0);
  CHECK(with("    timeout: 45 s", "    wait: 4 s")
            .find("p.yaml:8: key 'steps[1].wait': a step does one thing") == 0);
  CHECK(with("measurement: position_error", "measurement: position")
            .find("p.yaml:16: key 'criteria[0].measurement': found 'position', expected one of: "
                  "position_error") == 0);
  CHECK(
      with("statistic: rms", "statistic: average").find("p.yaml:16: key 'criteria[0].statistic'") ==
      0);
  CHECK(with("statistic: rms, ", "").find("p.yaml:16: key 'criteria[0].statistic': is missing") ==
        0);
  CHECK(with("max: 20 mm", "max: 20 deg")
            .find("p.yaml:16: key 'criteria[0].max': found '20 deg', expected a length") == 0);
  CHECK(with(", max: 20 mm", "").find("p.yaml:16: key 'criteria[0].name'") == 0);
  CHECK(with("phase: final, max", "phase: finale, max") ==
        "p.yaml:16: key 'criteria': criterion 'position': found phase 'finale', expected one of: "
        "run, move, acquire, final, hold, wait, annotate");
  CHECK(with("${speed}", "${spede}") ==
        "p.yaml:9: parameter 'spede' is not defined; there are: speed, start");
  CHECK(with("${speed}", "20 mm/s") == "p.yaml:3: key 'parameters.speed': is never used");
  CHECK(with("name: good", "nmae: good").find("p.yaml:1: key 'name': is missing") == 0);
  CHECK(with("criteria:", "criterion:").find("p.yaml:15: key 'criterion': is not known here") == 0);
  CHECK(with("hold: 10 s", "hold: 0 s").find("expected a time above 0") != std::string::npos);
}

TEST_CASE("steps out of order are refused before anything moves") {
  CHECK(error_of("name: a\nsteps:\n  - approach: {standoff: 3 m, speed: 1 mm/s}\n") ==
        "p.yaml:3: step 'approach' needs an 'acquire' before it");
  CHECK(error_of("name: a\nsteps:\n  - acquire: {}\n  - stop_tracking:\n  - station_keep: 5 s\n") ==
        "p.yaml:5: step 'station_keep' needs an 'acquire' before it");
  CHECK(error_of("name: a\nsteps:\n  - wait: 1 s\nteardown:\n  - acquire: {}\n")
            .find("p.yaml:5: step 'acquire' cannot be in the teardown") == 0);
  CHECK(error_of("name: a\nsteps: []\n").find("expected at least one step") != std::string::npos);
}

TEST_CASE("the shipped procedures are good") {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("procedures")) {
    if (entry.path().extension() != ".yaml") continue;
    INFO(entry.path());
    const Procedure p = load_procedure(entry.path());
    CHECK_FALSE(p.criteria.empty());
    ++count;
  }
  CHECK(count >= 3);
}
