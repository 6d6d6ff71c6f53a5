// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/junit.h"

#include <limits>

#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

criterion_result_t criterion(const char* name, std::int8_t result) {
  criterion_result_t c{};
  c.name = name;
  c.measurement = "rms position_error";
  c.phase = "go";
  c.unit = "mm";
  c.value = 3;
  c.lower_limit = -infinity;
  c.upper_limit = 2;
  c.result = result;
  return c;
}

Comparison finished(std::int8_t outcome) {
  const procedure_state_t state = made::state({{"go", 0, 10}, {"hold", 10, 12}});
  Comparison comparison;
  comparison.procedure = "made";
  comparison.steps = state.steps;
  comparison.duration_s = 13;
  comparison.outcome = outcome;
  return comparison;
}

bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("a run is a test suite with a case per step and per criterion") {
  Comparison comparison = finished(procedure_state_t::FAIL);
  comparison.criteria = {criterion("near", criterion_result_t::PASSED),
                         criterion("far", criterion_result_t::FAILED),
                         criterion("who knows", criterion_result_t::INCONCLUSIVE)};
  const std::string xml = junit_xml({junit_suite_of(comparison)});
  CHECK(has(
      xml,
      R"(<testsuite name="made" tests="5" failures="1" errors="0" skipped="1" time="13.000">)"));
  CHECK(has(xml, R"(<testcase classname="made.steps" name="1 go" time="10.000"/>)"));
  CHECK(has(xml, R"(<testcase classname="made.criteria" name="near" time="0.000"/>)"));
  CHECK(has(xml, R"(<failure message="result FAIL; value 3.000; unit mm; +- 0.000; max 2.000; )"
                 R"(margin -1.000; of rms position_error, go")"));
  CHECK(has(xml, R"(<testcase classname="made.criteria" name="who knows")"));
  CHECK(has(xml, "<skipped message="));
}

TEST_CASE("a rig that broke is an error, what did not run was skipped") {
  Comparison comparison = finished(procedure_state_t::TIMEOUT);
  comparison.steps[0].state = procedure_step_t::TIMEOUT;
  comparison.steps[0].detail = "no pose";
  comparison.steps[1].state = procedure_step_t::PENDING;
  const std::string xml = junit_xml({junit_suite_of(comparison)});
  CHECK(has(xml, R"(tests="2" failures="0" errors="1" skipped="1")"));
  CHECK(has(xml, R"(<error message="state TIMEOUT; detail no pose" type="error"/>)"));
  CHECK(has(xml, R"(<skipped message="state PENDING"/>)"));
}

TEST_CASE("a verdict that no step and no criterion explains has a case of its own") {
  Comparison comparison = finished(procedure_state_t::ERROR);
  comparison.reason = "no lease on the testbed";
  const std::string xml = junit_xml({junit_suite_of(comparison)});
  CHECK(has(xml, R"(tests="3" failures="0" errors="1")"));
  CHECK(has(xml, R"(<testcase classname="made" name="verdict")"));
  CHECK(has(xml, R"(<error message="outcome ERROR; reason no lease on the testbed")"));
}

TEST_CASE("whatever text a run holds, its report is well-formed") {
  JunitSuite suite;
  suite.name = "<\"&'>";
  Table table{"l", {"what"}};
  table.rows.push_back(
      {{"two\nlines"}, Table::failed, "bell \x07 latin \xE9 utf \xC3\xA9 cut \xE2\x82"});
  suite.tables = {{"c", table}};
  const std::string xml = junit_xml({suite, suite});
  CHECK(has(xml, R"(name="&lt;&quot;&amp;&#39;&gt;")"));
  CHECK(has(xml, "name=\"bell \uFFFD latin \uFFFD utf \u00E9 cut \uFFFD\uFFFD\""));
  CHECK(has(xml, "message=\"what two&#10;lines\""));
  CHECK(has(xml, R"(<testsuites name="berth" tests="2" failures="2" errors="0" skipped="0")"));
}
