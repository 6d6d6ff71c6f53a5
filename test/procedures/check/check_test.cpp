// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/check/check.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/core/error.h"
#include "evaluation/run/run_record.h"
#include "evaluation/run/target_surface.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::procedures;
using Catch::Matchers::Contains;

namespace {

RunSetup setup_for(const Procedure& procedure) {
  RunSetup setup;
  setup.config = "config";
  if (!procedure.layout.empty()) setup.layout = procedure.layout;
  setup.target = procedure.target.empty() ? "radarsat2" : procedure.target;
  return setup;
}

CheckReport check_text(const std::string& text) {
  const Procedure procedure = parse_procedure(text, "p.yaml");
  return check_procedure(procedure, setup_for(procedure));
}

/// The lines that matter, one per finding.
std::string findings_of(const CheckReport& report) {
  std::string text;
  for (const Finding& finding : report.findings) {
    if (finding.severity != Severity::note) text += text_of(finding) + "\n";
  }
  return text;
}

const std::string tracked = R"(name: tracked
steps:
  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 200 mm/s}
  - acquire: {gate: [3 m, 8 m]}
  - track: {settle: 3}
  - hold: 20 s
)";

}  // namespace

TEST_CASE("every procedure shipped checks without error or warning") {
  const auto shipped = procedures_in("procedures");
  for (const std::filesystem::path& file : shipped) {
    const Procedure procedure = load_procedure(file);
    const CheckReport report = check_procedure(procedure, setup_for(procedure));
    INFO(findings_of(report));
    CHECK(findings_of(report).empty());
    CHECK(report.duration > 0);
    CHECK(report.steps.size() == procedure.steps.size() + procedure.teardown.size());
  }
  CHECK(shipped.size() >= 4);
}

TEST_CASE("motions are planned one from where the other ends, with what there is to spare") {
  const CheckReport report = check_text(R"(name: x
steps:
  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}
  - move: {to: [0, 0, 4500, 0, 0, 0], speed: 50 mm/s}
  - wait: 7 s
)");
  INFO(findings_of(report));
  REQUIRE(report.good());
  REQUIRE(report.steps.size() >= 3);
  // half a metre at 50 mm/s takes ten seconds and the ramps
  CHECK(report.steps[1].duration == Approx(11.5).margin(1));
  CHECK_FALSE(report.steps[1].guessed);
  CHECK(report.steps[1].clearance > 0.1);
  CHECK(report.steps[1].joint_margin > 0);
  CHECK_FALSE(report.steps[1].joint.empty());
  CHECK(report.steps[2].duration == Approx(7));
  CHECK(report.steps[2].start == Approx(report.steps[0].duration + report.steps[1].duration));
}

TEST_CASE("a retreat leads back to where the last motion began; a second one leads nowhere") {
  const CheckReport report = check_text(R"(name: x
steps:
  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}
  - move: {to: [200, 0, 4500, 0, 10, 0], speed: 50 mm/s}
  - retreat: {}
  - retreat: {}
)");
  INFO(findings_of(report));
  CHECK(report.steps[2].moves);
  CHECK(report.steps[2].duration > 5);
  CHECK_THAT(findings_of(report),
             Contains("p.yaml:6: error: step 'retreat': the testbed refuses: there is "
                      "no way back"));
}

TEST_CASE("a motion is refused with where, when and which limit, and the next ones are looked at") {
  const CheckReport report = check_text(R"(name: x
steps:
  - move: {to: [0, 0, 9000, 0, 0, 0], speed: 100 mm/s}
  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}
  - move: {to: [0, 0, 5000, 0, 0, 60], speed: 100 mm/s, turn: 29 deg/s}
  - move: {to: [0, 0, 4800, 0, 0, 0], speed: 2 m/s}
)");
  CHECK_FALSE(report.good());
  CHECK_THAT(findings_of(report),
             Contains("p.yaml:3: error: step 'move': the testbed refuses: at ") &&
                 Contains("relative pose (") && Contains("limit"));
  CHECK(report.steps[1].moves);
  CHECK(report.steps[1].refusal.empty());
  CHECK_THAT(findings_of(report),
             Contains("p.yaml:6: error") && Contains("2000.0 mm/s is not within"));
}

TEST_CASE("a target out of the LIDAR's view is reported where it is to be found or tracked") {
  CHECK(findings_of(check_text(tracked)).empty());
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = tracked;
    const auto at = text.find(from);
    REQUIRE(at != std::string::npos);
    return findings_of(check_text(text.replace(at, from.size(), to)));
  };
  CHECK_THAT(with("[3 m, 8 m]", "[6 m, 8 m]"),
             Contains("p.yaml:4: error: step 'acquire'") && Contains("the gate begins at 6.00 m"));
  CHECK_THAT(with("  - hold: 20 s", "  - approach: {standoff: 2 m, speed: 100 mm/s}"),
             Contains("sees nothing") && Contains("its least range is 3.00 m"));
  CHECK_THAT(with("  - hold: 20 s", "  - scan: {width: 50 deg, height: 5 deg, count: 500}"),
             Contains("field of view ends at 20 deg"));
  CHECK_THAT(with("settle: 3", "strategy: wild"),
             Contains("found strategy 'wild'; expected one of: dense, sparse"));
}

TEST_CASE("criteria must name what the run will record") {
  const auto with = [](const std::string& criterion) {
    return findings_of(check_text(tracked + "criteria:\n  - {name: c, " + criterion + "}\n"));
  };
  CHECK(with("measurement: position_error, statistic: rms, phase: hold, max: 10 mm").empty());
  CHECK_THAT(with("measurement: attitude_error, statistic: rms, phase: move, max: 1 deg"),
             Contains("p.yaml:8: error: criterion 'c'") && Contains("nothing is tracked"));
  CHECK_THAT(with("measurement: tracking_share, phase: move, min: 90 %"),
             Contains("nothing is tracked in phase 'move'"));
  CHECK_THAT(with("measurement: surface_range, statistic: min, min: 6 m"),
             Contains("if all goes as planned") && Contains("at least 6000.00 mm"));
  CHECK_THAT(
      with("measurement: position_error, statistic: rms, phase: hold, max: 10 mm, samples: 99"),
      Contains("warning") && Contains("samples are to be expected"));
  CHECK_THAT(with("measurement: position_error, statistic: rms, phase: hold, max: 1 mm"),
             Contains("warning") && Contains("truth itself is uncertain"));
}

TEST_CASE("a criterion that only an outside GNC can meet is left to it") {
  const auto after = [](const std::string& step) {
    return findings_of(
        check_text(tracked + "  - " + step + "\n  - hold: 5 s\n    phase: there\n" +
                   "criteria:\n  - {name: c, measurement: surface_range, statistic: p95, "
                   "phase: there, max: 3.7 m}\n"));
  };
  CHECK(after("guided: {by: my-gnc, for: 1 min, speed: 50 mm/s}").empty());
  // once the arms have been commanded to a pose, it is known again
  CHECK_THAT(after("guided: {by: my-gnc, for: 1 min, speed: 50 mm/s}\n"
                   "  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 200 mm/s}"),
             Contains("if all goes as planned"));
}

TEST_CASE("a target without a docking interface is not docked with") {
  Procedure procedure = parse_procedure(tracked + R"(
  - approach: {standoff: 3.5 m, speed: 50 mm/s, dock: true}
criteria:
  - {name: c, measurement: docking_range, statistic: final, max: 4 m}
)",
                                        "p.yaml");
  RunSetup setup = setup_for(procedure);
  CHECK(check_procedure(procedure, setup).good());
  const auto mesh = std::filesystem::temp_directory_path() / "berth-check-target.ply";
  Mesh inside_out = make_box({2, 0.6, 0.4});
  for (auto& t : inside_out.triangles) std::swap(t[0], t[1]);
  save_ply(inside_out, mesh);
  setup.target = mesh;
  const std::string error = findings_of(check_procedure(procedure, setup));
  std::filesystem::remove(mesh);
  CHECK_THAT(error, Contains("step 'approach'") && Contains("has no docking port"));
  CHECK_THAT(error, Contains("criterion 'c'"));
  CHECK_THAT(error, Contains("berth-check-target.ply: warning: target: its surface is inside out"));
}

TEST_CASE("a step that cannot end in its time is an error when its time is known") {
  CHECK_THAT(
      findings_of(check_text("name: x\nsteps:\n  - move: {to: [0, 0, 4500, 0, 0, 0], speed: 20 "
                             "mm/s}\n    timeout: 10 s\n")),
      Contains("p.yaml:3: error") && Contains("timeout of 10.0 s"));
}

TEST_CASE("each measurement that there is can be forecast") {
  // Gains and the time offset want a target that moves along and about every axis while tracked.
  const Procedure procedure = parse_procedure(tracked +
                                                  "  - move: {to: [150, -150, 4700, 12, -12, 15], "
                                                  "speed: 50 mm/s, turn: 4 deg/s}\n  - hold: 5 s\n",
                                              "p.yaml");
  Rig rig(setup_for(procedure));
  Rehearsal rehearsal(rig, rig.home());
  for (const Step& step : procedure.steps) rehearsal.perform(step);
  const evaluation::RunRecord record = forecast_record(rig, rehearsal, true);
  const evaluation::Measurer measurer(record, evaluation::nearest_point_on(rig.cell.target));
  const auto run = record.phase(evaluation::whole_run);
  REQUIRE(run);
  CHECK(run->duration_s() == Approx(rehearsal.duration()));
  for (const evaluation::Measurement& measurement : evaluation::measurements()) {
    // Nobody foresees a fault, nor the returns of a scan.
    if (measurement.name == std::string("residual") ||
        measurement.name == std::string("reaction_time") ||
        measurement.name == std::string("stopping_time")) {
      continue;
    }
    // Steps are between two rests, which are stretches of one phase.
    const bool of_steps = std::string(measurement.name).find("_step") != std::string::npos;
    const auto measured = measurer.measure(measurement, evaluation::Statistic::rms,
                                           of_steps ? *record.phase("hold") : *run);
    INFO(measurement.name << ": " << measured.reason);
    CHECK_FALSE(std::isnan(measured.value));
  }
  // As often as the LIDAR can: 20 s of holding with the estimator's own number of returns.
  const auto rate = measurer.measure(*evaluation::measurement_named("update_rate"),
                                     evaluation::Statistic::rms, *record.phase("hold"));
  CHECK(rate.value == Approx(1 / rig.scan_period(0)).epsilon(0.1));
}

TEST_CASE("a report as JSON has the same content") {
  const CheckReport report = check_text(R"(name: x
steps:
  - move: {to: [0, 0, 9000, 0, 0, 0], speed: 100 mm/s}
)");
  const auto json = json_of(report);
  CHECK(json["good"] == false);
  CHECK(json["steps"][0]["refusal"] == report.steps[0].refusal);
  CHECK(json["findings"][0]["line"] == 3);
  CHECK(json["findings"][0]["severity"] == "error");
}

TEST_CASE("a reader's error becomes a finding with its place") {
  const Finding finding = finding_of_error("a/b.yaml:7: key 'x': found y", "c.yaml");
  CHECK(finding.file == "a/b.yaml");
  CHECK(finding.line == 7);
  CHECK(finding.found == "key 'x': found y");
  const Finding other = finding_of_error("cannot open b.yaml: no such file", "c.yaml");
  CHECK(other.file == "c.yaml");
  CHECK(other.line == 0);
  CHECK(other.found == "cannot open b.yaml: no such file");
}
