// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/junit.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "lcmtypes/words.h"

namespace berth::evaluation {
namespace {

using Result = JunitCase::Result;

std::string attribute(const char* name, const std::string& value) {
  return std::string(" ") + name + "=\"" + markup_text(value) + "\"";
}

std::string attribute(const char* name, std::size_t value) {
  return attribute(name, std::to_string(value));
}

std::size_t count(const JunitSuite& suite, Result result) {
  return static_cast<std::size_t>(
      std::count_if(suite.cases.begin(), suite.cases.end(),
                    [result](const JunitCase& c) { return c.result == result; }));
}

std::string text_of(const JunitCase& c) {
  std::string text = "    <testcase" + attribute("classname", c.class_name) +
                     attribute("name", c.name) + attribute("time", fixed(c.time_s, 3));
  if (c.result == Result::passed) return text + "/>\n";
  const char* tag = c.result == Result::failed  ? "failure"
                    : c.result == Result::error ? "error"
                                                : "skipped";
  text += std::string(">\n      <") + tag + attribute("message", c.message);
  if (c.result != Result::skipped) text += attribute("type", tag);
  return text + "/>\n    </testcase>\n";
}

std::string text_of(const JunitSuite& suite) {
  std::string text = "  <testsuite" + attribute("name", suite.name) +
                     attribute("tests", suite.cases.size()) +
                     attribute("failures", count(suite, Result::failed)) +
                     attribute("errors", count(suite, Result::error)) +
                     attribute("skipped", count(suite, Result::skipped)) +
                     attribute("time", fixed(suite.time_s, 3)) + ">\n    <properties>\n";
  for (const auto& [name, value] : suite.properties) {
    text += "      <property" + attribute("name", name) + attribute("value", value) + "/>\n";
  }
  text += "    </properties>\n";
  for (const JunitCase& c : suite.cases) text += text_of(c);
  if (!suite.output.empty()) {
    text += "    <system-out>" + markup_text(suite.output) + "</system-out>\n";
  }
  return text + "  </testsuite>\n";
}

JunitCase case_of(const procedure_step_t& step, std::size_t number, const std::string& procedure) {
  JunitCase c;
  c.class_name = procedure + ".steps";
  c.name = std::to_string(number) + " " + step.name;
  c.time_s = step.utime_end > step.utime_start ? seconds(step.utime_end - step.utime_start) : 0;
  c.message = step.detail;
  switch (step.state) {
    case procedure_step_t::PASSED:
      break;
    case procedure_step_t::PENDING:
      c.result = Result::skipped;
      c.message = "did not run";
      break;
    case procedure_step_t::SKIPPED:
      c.result = Result::skipped;
      break;
    case procedure_step_t::FAILED:
      c.result = Result::failed;
      break;
    default:
      c.result = Result::error;
      c.message = std::string(words::of_step_state(step.state)) +
                  (step.detail.empty() ? "" : ": " + step.detail);
  }
  return c;
}

std::string limits_text(const criterion_result_t& c) {
  std::string text;
  if (std::isfinite(c.lower_limit)) text += ", min " + shown(c.lower_limit);
  if (std::isfinite(c.upper_limit)) text += ", max " + shown(c.upper_limit);
  return text + (c.unit.empty() ? "" : " " + c.unit);
}

JunitCase case_of(const criterion_result_t& criterion, const std::string& procedure) {
  JunitCase c;
  c.class_name = procedure + ".criteria";
  c.name = criterion.name;
  c.message = criterion.measurement + " over " + criterion.phase + ": " + shown(criterion.value) +
              " +- " + shown(criterion.uncertainty) + limits_text(criterion) +
              (criterion.reason.empty() ? "" : "; " + criterion.reason);
  c.result = criterion.result == criterion_result_t::PASSED   ? Result::passed
             : criterion.result == criterion_result_t::FAILED ? Result::failed
                                                              : Result::skipped;
  return c;
}

Result result_of_outcome(std::int8_t outcome) {
  switch (outcome) {
    case procedure_state_t::PASS:
      return Result::passed;
    case procedure_state_t::FAIL:
      return Result::failed;
    case procedure_state_t::INCONCLUSIVE:
      return Result::skipped;
    default:
      return Result::error;
  }
}

}  // namespace

JunitSuite junit_suite_of(const Comparison& comparison) {
  JunitSuite suite;
  suite.name = comparison.procedure.empty() ? "berth" : comparison.procedure;
  suite.time_s = comparison.duration_s;
  if (comparison.info) {
    const run_info_t& info = *comparison.info;
    suite.properties = {{"run", info.run},
                        {"host", text_of_host(info.host)},
                        {"version", info.version},
                        {"seed", std::to_string(info.seed)},
                        {"layout", info.layout},
                        {"target", info.target},
                        {"configuration_hash", info.configuration_hash}};
  }
  for (std::size_t i = 0; i < comparison.steps.size(); ++i) {
    suite.cases.push_back(case_of(comparison.steps[i], i + 1, suite.name));
  }
  for (const criterion_result_t& c : comparison.criteria) {
    suite.cases.push_back(case_of(c, suite.name));
  }
  const Result verdict = result_of_outcome(comparison.outcome);
  if (verdict != Result::passed && count(suite, verdict) == 0) {
    suite.cases.push_back({suite.name, "verdict", verdict,
                           std::string(words::of_outcome(comparison.outcome)) +
                               (comparison.reason.empty() ? "" : ": " + comparison.reason),
                           0});
  }
  suite.output = verdict_table(comparison.criteria) + verdict_line(comparison) + "\n";
  return suite;
}

std::string junit_xml(const std::vector<JunitSuite>& suites) {
  std::size_t tests = 0;
  std::size_t failures = 0;
  std::size_t errors = 0;
  std::size_t skipped = 0;
  double time_s = 0;
  for (const JunitSuite& suite : suites) {
    tests += suite.cases.size();
    failures += count(suite, Result::failed);
    errors += count(suite, Result::error);
    skipped += count(suite, Result::skipped);
    time_s += suite.time_s;
  }
  std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"berth\"" +
                     attribute("tests", tests) + attribute("failures", failures) +
                     attribute("errors", errors) + attribute("skipped", skipped) +
                     attribute("time", fixed(time_s, 3)) + ">\n";
  for (const JunitSuite& suite : suites) text += text_of(suite);
  return text + "</testsuites>\n";
}

}  // namespace berth::evaluation
