// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/table.h"

#include <nlohmann/json.hpp>

#include "evaluation/compare/junit.h"
#include "evaluation/report/html.h"
#include "test/catch.h"

using namespace berth;
using Catch::Contains;

namespace {

/// A row of each kind, a column for people alone and one for JSON alone.
Table made_table() {
  Table table{"ll",
              {no_json("result"), keyed("who", "name"), keyed("value, mm", "value"), "count",
               json_only("may_fail"), json_only("claim")}};
  table.rows.push_back({{"FAIL", "a < b", valued("2.5", 2.5), 7, valued("", true), "small"},
                        Table::failed,
                        "a < b",
                        "too large",
                        1.5});
  table.rows.push_back(
      {{"ok", "c", valued("-", std::nan("")), 0, valued("", false)}, Table::passed, "c"});
  table.rows[1].cells[1].link = "runs/c d";
  return table;
}

}  // namespace

TEST_CASE("One table is rendered as text, Markdown, CSV, JSON, HTML and JUnit") {
  const Table table = made_table();
  CHECK(text_table(table) ==
        "  result  who    value, mm  count\n"
        "  FAIL    a < b        2.5      7\n"
        "  ok      c              -      0\n"
        "  a < b: too large\n");
  CHECK_THAT(markdown_table(table), Contains("| FAIL | a < b | 2.5 | 7 |\n"));
  CHECK(csv_table(table) == "result,who,\"value, mm\",count\nFAIL,a < b,2.5,7\nok,c,-,0\n");
  CHECK(json_table(table).dump() ==
        R"([{"name":"a < b","value":2.5,"count":7,"may_fail":true,"claim":"small"},)"
        R"({"name":"c","value":null,"count":0,"may_fail":false}])");

  const std::string html = report::html_of(table).code;
  CHECK_THAT(html,
             Contains(R"(<th class="l">result</th><th class="l">who</th><th>value, mm</th>)"));
  CHECK_THAT(html, Contains(R"(<td class="l"><b class="bad">FAIL</b></td>)"
                            R"(<td class="l">a &lt; b</td><td>2.5</td><td>7</td></tr>)"));
  CHECK_THAT(html, Contains(R"(<td class="l"><a href="./runs/c%20d">c</a></td>)"));
  CHECK_THAT(html, Contains("a &lt; b: too large"));

  CHECK_THAT(
      evaluation::junit_xml({{"suite", 2, {}, {{"class", table}}, ""}}),
      Contains(R"(<testsuite name="suite" tests="2" failures="1" errors="0" skipped="0")") &&
          Contains(R"(<testcase classname="class" name="c" time="0.000"/>)") &&
          Contains("<testcase classname=\"class\" name=\"a &lt; b\" time=\"1.500\">\n"
                   "      <failure message=\"result FAIL; value, mm 2.5; count 7; too large\" "
                   "type=\"failure\"/>\n    </testcase>"));
}

TEST_CASE("JSON of a table has one object a row, whatever its cells hold") {
  Table table{"", {"a", json_only("b"), "", keyed("c", "d")}};
  CHECK(json_table(table).dump() == "[]");
  table.rows = {{"\xFF\"\n", "x", "y", 1}, {}, {"alone"}};
  const auto json = nlohmann::ordered_json::parse(
      json_table(table).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  REQUIRE(json.size() == 3);
  CHECK(json[0].size() == 3);
  CHECK(json[1].empty());
  CHECK(json[2] == nlohmann::ordered_json{{"a", "alone"}});
}

TEST_CASE("A cell that is drawn is in HTML alone") {
  Table table{"", {"bar"}};
  table.rows.push_back({report::markup("<i></i>")});
  CHECK_THAT(report::html_of(table).code, Contains("<td><i></i></td>"));
  CHECK(text_table(table) == "  bar\n\n");
}
