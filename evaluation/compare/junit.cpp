// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/junit.h"

#include <algorithm>

#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "lcmtypes/words.h"

namespace berth::evaluation {
namespace {

std::string attribute(const char* name, const std::string& value) {
  return std::string(" ") + name + "=\"" + markup_text(value) + "\"";
}

std::string attribute(const char* name, std::size_t value) {
  return attribute(name, std::to_string(value));
}

/// Test cases of a suite.
struct Counts {
  std::size_t tests = 0;
  std::size_t failures = 0;
  std::size_t errors = 0;
  std::size_t skipped = 0;

  void add(const JunitSuite& suite) {
    for (const auto& [class_name, table] : suite.tables) {
      for (const Table::Row& row : table.rows) {
        ++tests;
        failures += row.status == Table::failed ? 1 : 0;
        errors += row.status == Table::error ? 1 : 0;
        skipped += row.status == Table::inconclusive ? 1 : 0;
      }
    }
  }
  std::string attributes(double time_s) const {
    return attribute("tests", tests) + attribute("failures", failures) +
           attribute("errors", errors) + attribute("skipped", skipped) +
           attribute("time", fixed(time_s, 3));
  }
};

/// "result FAIL; value 3.000; max 2.000": the cells that hold anything but the row's name.
std::string message_of(const Table& table, const Table::Row& row) {
  const auto headings = table.headings();
  const auto cells = table.shown(row);
  std::string text;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (cells[i].text.empty() || cells[i].text == row.name) continue;
    text += (text.empty() ? "" : "; ") + headings.at(i) + " " + cells[i].text;
  }
  return text + (row.note.empty() ? "" : "; " + row.note);
}

std::string text_of(const std::string& class_name, const Table& table, const Table::Row& row) {
  std::string text = "    <testcase" + attribute("classname", class_name) +
                     attribute("name", row.name) + attribute("time", fixed(row.time_s, 3));
  if (row.status == Table::none || row.status == Table::passed) return text + "/>\n";
  const char* tag = row.status == Table::failed  ? "failure"
                    : row.status == Table::error ? "error"
                                                 : "skipped";
  text += std::string(">\n      <") + tag + attribute("message", message_of(table, row));
  if (row.status != Table::inconclusive) text += attribute("type", tag);
  return text + "/>\n    </testcase>\n";
}

std::string text_of(const JunitSuite& suite) {
  Counts counts;
  counts.add(suite);
  std::string text = "  <testsuite" + attribute("name", suite.name) +
                     counts.attributes(suite.time_s) + ">\n    <properties>\n";
  for (const auto& [name, value] : suite.properties) {
    text += "      <property" + attribute("name", name) + attribute("value", value) + "/>\n";
  }
  text += "    </properties>\n";
  for (const auto& [class_name, table] : suite.tables) {
    for (const Table::Row& row : table.rows) text += text_of(class_name, table, row);
  }
  if (!suite.output.empty()) {
    text += "    <system-out>" + markup_text(suite.output) + "</system-out>\n";
  }
  return text + "  </testsuite>\n";
}

Table::Status status_of_outcome(std::int8_t outcome) {
  switch (outcome) {
    case procedure_state_t::PASS:
      return Table::passed;
    case procedure_state_t::FAIL:
      return Table::failed;
    case procedure_state_t::INCONCLUSIVE:
      return Table::inconclusive;
    default:
      return Table::error;
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
  const Table steps = steps_table(comparison.steps);
  const Table criteria = criteria_table(comparison.criteria);
  suite.tables = {{suite.name + ".steps", steps}, {suite.name + ".criteria", criteria}};
  const Table::Status verdict = status_of_outcome(comparison.outcome);
  const auto explains = [verdict](const Table::Row& row) { return row.status == verdict; };
  if (verdict != Table::passed && std::none_of(steps.rows.begin(), steps.rows.end(), explains) &&
      std::none_of(criteria.rows.begin(), criteria.rows.end(), explains)) {
    Table table{"l", {no_json("outcome"), no_json("reason")}};
    table.rows.push_back(
        {{words::of_outcome(comparison.outcome), comparison.reason}, verdict, "verdict"});
    suite.tables.emplace_back(suite.name, table);
  }
  suite.output = text_table(criteria) + verdict_line(comparison) + "\n";
  return suite;
}

std::string junit_xml(const std::vector<JunitSuite>& suites) {
  Counts counts;
  double time_s = 0;
  std::string list;
  for (const JunitSuite& suite : suites) {
    counts.add(suite);
    time_s += suite.time_s;
    list += text_of(suite);
  }
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"berth\"" +
         counts.attributes(time_s) + ">\n" + list + "</testsuites>\n";
}

}  // namespace berth::evaluation
