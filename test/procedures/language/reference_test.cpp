// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/config.h"
#include "common/core/file.h"
#include "procedures/language/procedure.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/procedures/language/parsed.h"

using namespace berth;
using namespace berth::procedures;

namespace {

const char* const remark = R"(name: remark
parameters:
  words: plain     # for the log
  pause: 2 s
steps:
  - annotate: ${words}
  - prompt: {text: ${words}, choices: ["${words}", "no"], default: '${words}'}
  - annotate: "say ${words}, twice: ${words}"
  - wait: ${pause}
    phase: after ${pause}
criteria:
  - {name: "${words}", measurement: duration, min: 0 s}
teardown:
  - annotate: the end
)";

std::vector<std::string> texts_of(const Procedure& p) {
  const auto& prompt = std::get<Prompt>(p.steps.at(1).verb);
  return {std::get<Annotate>(p.steps.at(0).verb).text,
          prompt.text,
          prompt.choices.at(0),
          prompt.default_value,
          p.criteria.at(0).name,
          std::get<Annotate>(p.steps.at(2).verb).text};
}

}  // namespace

TEST_CASE("whatever a value holds, it is that text wherever it is referred to, and as recorded") {
  for (const std::string value : {"it's",        "a # b", "a: b",     "x, choices: [y]",
                                  "\"q\"",       "]",     "}",        "a\nsteps: []",
                                  "null",        "~",     "- a",      "*a",
                                  "&a b",        "!t",    "${pause}", "${other}",
                                  "---",         "<<",    " a ",      "a\\nb",
                                  "|",           ">",     "{a: 1}",   "[1, 2]",
                                  "H\xC3\xB6he", "%",     "@",        "tab\there",
                                  "as_run: true"}) {
    INFO(value);
    const Procedure p = parse_procedure(remark, "p.yaml", {{"words", value}});
    REQUIRE(p.steps.size() == 4);
    REQUIRE(p.teardown.size() == 1);
    const std::string twice = "say " + value + ", twice: " + value;
    CHECK(texts_of(p) == std::vector<std::string>{value, value, value, value, value, twice});
    CHECK(p.steps[3].phase == "after 2 s");
    // What is kept of it reads the same, and is one document of YAML for any reader.
    const Procedure again = parse_procedure(p.text, "elsewhere.yaml", {{"words", value}});
    CHECK(texts_of(again) == texts_of(p));
    CHECK(again.teardown.size() == 1);
    CHECK(again.text == p.text);
    Config recorded = Config::parse(p.text, "recorded.yaml");
    CHECK(recorded.section("parameters").text("words") == value);
    CHECK(error_of(p.text, {{"words", value + "!"}}).find("as it was run") != std::string::npos);
  }
}

TEST_CASE("what no text can hold, or what would be taken for a reference, is no value") {
  const auto error_of_value = [](const std::string& value) {
    return error_of(remark, {{"words", value}});
  };
  CHECK(error_of_value("") == "parameter 'words': found '', expected one value such as 'plain'");
  CHECK(error_of_value("$<pause>").find("expected one value") != std::string::npos);
  CHECK(error_of_value("\xEF\xBB\xBFx").find("byte order mark") != std::string::npos);
  CHECK(error_of_value("a\xEF\xBB\xBFx").find("U+FEFF") != std::string::npos);
  CHECK(error_of_value("\xFF").find("not UTF-8") != std::string::npos);
  CHECK(error_of_value("a\rb").find("lines that end in LF") != std::string::npos);
}

TEST_CASE("the values of a procedure's own file may hold anything too") {
  const auto remarked = [](const std::string& value) {
    const Procedure p = parse_procedure(
        "name: t\nparameters:\n  words: " + value + "\nsteps:\n  - annotate: so ${words}\n",
        "p.yaml");
    CHECK(parse_procedure(p.text, "q.yaml").text == p.text);
    return std::get<Annotate>(p.steps.at(0).verb).text;
  };
  CHECK(remarked("it's # mine") == "so it's");
  CHECK(remarked("'it''s # mine'") == "so it's # mine");
  CHECK(remarked("\"a: \\\"b\\\"\"   # 'quoted'") == "so a: \"b\"");
  CHECK(remarked("don't  # won't") == "so don't");
  CHECK(remarked("|\n    one\n    two") == "so one\ntwo\n");
  CHECK(remarked(">-\n    one\n    two") == "so one two");
}

TEST_CASE("what stands before the parameters, or the way they are written, does not hide them") {
  const std::string rest = "steps:\n  - wait: ${pause}\n";
  for (const std::string& text :
       {"\xEF\xBB\xBFparameters:\n  pause: 2 s\nname: t\n" + rest,
        "name: t\nparameters: {pause: 2 s}\n" + rest,
        "name: it's # mine\nparameters:\n  # of the wait, that's\n  pause: 2 s\n" + rest,
        "name: t\r\nparameters:\r\n  pause: 2 s\r\n" + rest,
        "name: t\nparameters:\n  pause:\n    2 s\n" + rest,
        "\"name\": t\n\"parameters\":\n  \"pause\": \"2 s\"\n" + rest}) {
    INFO(text);
    const Procedure p = parse_procedure(text, "p.yaml", {{"pause", "3 s"}});
    CHECK(std::get<Wait>(p.steps.at(0).verb).duration == 3);
    CHECK(std::get<Wait>(parse_procedure(p.text, "q.yaml").steps.at(0).verb).duration == 3);
  }
}

TEST_CASE("a reference is found in a text of several lines, in the midst of apostrophes") {
  const Procedure p = parse_procedure(
      "name: t\nparameters:\n  who: Ann\nsteps:\n  - annotate: |\n      It's ${who}'s # not a "
      "comment\n      second\n  - annotate: don't tell ${who} # ${nobody}\n  - annotate: '${who} "
      "isn''t'\n",
      "p.yaml");
  CHECK(std::get<Annotate>(p.steps[0].verb).text == "It's Ann's # not a comment\nsecond\n");
  CHECK(std::get<Annotate>(p.steps[1].verb).text == "don't tell Ann");
  CHECK(std::get<Annotate>(p.steps[2].verb).text == "Ann isn't");
  CHECK(parse_procedure(p.text, "q.yaml").text == p.text);
}

TEST_CASE("a sweep's values are texts and lists, not pieces of YAML") {
  const Procedure p = parsed_steps(
      "  - sweep:\n      words: [\"it's: #1\", '[1, 2]', \"a, b\"]\n      steps:\n"
      "        - annotate: ${words}\n"
      "          phase: \"${words}\"\n");
  REQUIRE(p.steps.size() == 3);
  CHECK(std::get<Annotate>(p.steps[0].verb).text == "it's: #1");
  CHECK(p.steps[1].phase == "[1, 2]");
  CHECK(p.steps[2].name == "annotate (words a, b)");
  CHECK(p.steps[2].line == 6);
  const Procedure again = parse_procedure(p.text, "q.yaml");
  CHECK(again.steps[0].phase == p.steps[0].phase);
  CHECK(again.text == p.text);
}

TEST_CASE("a call gives values, not pieces of YAML") {
  const TemporaryDirectory folder;
  write_file(folder / "part.yaml",
             "name: part\nparameters:\n  words: x\n  list: [a, b]\nsteps:\n  - annotate: ${words}\n"
             "  - prompt: {text: which, choices: \"${list}\"}\n");
  write_file(folder / "main.yaml",
             "name: main\nsteps:\n  - call: {procedure: part.yaml, with: {words: \"it's: #1\", "
             "list: [\"a, b\", 'c: d']}}\n");
  const Procedure p = load_procedure(folder / "main.yaml");
  CHECK(std::get<Annotate>(p.steps.at(0).verb).text == "it's: #1");
  CHECK(std::get<Prompt>(p.steps.at(1).verb).choices == std::vector<std::string>{"a, b", "c: d"});
}

TEST_CASE("a called procedure is kept to the letter, however it ends, with its comments") {
  const TemporaryDirectory folder;
  write_file(folder / "main.yaml", "name: main   # mine\nsteps:\n  - call: part.yaml\n");
  for (const char* end : {"", "\n", "\n\n\n", "\n  # it's\n \n", "\n...\n"}) {
    INFO(end);
    write_file(folder / "part.yaml", std::string("name: part\nsteps:\n  - wait: 1 s") + end);
    const Procedure p = load_procedure(folder / "main.yaml");
    CHECK(p.text.find("# mine") != std::string::npos);
    const Procedure again = parse_procedure(p.text, "elsewhere/q.yaml");
    CHECK(std::get<Wait>(again.steps.at(0).verb).duration == 1);
    CHECK(Config::parse(p.text, "q").section("called").text("part.yaml") ==
          read_file(folder / "part.yaml"));
  }
}

TEST_CASE("errors name the line of the user's file, whatever was put in before it") {
  const std::string text =
      "name: t\nparameters:\n  words: x\nsteps:\n  - annotate: ${words}\n  - wait: 1 m\n";
  CHECK(error_of(text, {{"words", "one\ntwo\nthree"}}).find("p.yaml:6: key 'steps[1].wait'") == 0);
  CHECK(error_of("name: t\nparameters:\n  pause: 1 s\nsteps:\n  - annotate: x\n"
                 "  - hold: &h {a: ${pausee}}\n")
            .find("p.yaml:6: parameter 'pausee' is not defined; there are: pause") == 0);
  CHECK(error_of("name: t\nparameters:\n  a: 1 s\n  b: {c: 1}\nsteps:\n  - wait: ${a}\n") ==
        "p.yaml:4: key 'parameters': found 'b: {c: 1}', expected 'name: value'");
  CHECK(error_of("name: t\nparameters:\n  a: 1 s\nsteps:\n  - wait: ${a}\n  - {${a}: 1}\n")
            .find("p.yaml:6: key '$<a>': a key holds no reference") == 0);
}

TEST_CASE("what follows the end of a procedure's document does not go unread") {
  const std::string whole = "name: t\nsteps:\n  - wait: 1 s\n";
  CHECK(error_of(whole + "---\ncriteria: []\n").find("p.yaml:4: found a second document") == 0);
  // A document's end at the end is no harm: the text as run goes on.
  const Procedure p = parse_procedure(whole + "...\n", "p.yaml");
  CHECK(parse_procedure(p.text, "q.yaml").steps.size() == 1);
  const Procedure flow = parse_procedure("{name: t, steps: [{wait: 1 s}]}\n", "p.yaml");
  CHECK(parse_procedure(flow.text, "q.yaml").steps.size() == 1);
  CHECK(parse_procedure(flow.text, "q.yaml").text == flow.text);
}

TEST_CASE("anchors, aliases and merges may stand in a procedure, and in what is kept of it") {
  const Procedure p = parse_procedure(
      "name: t\nparameters:\n  far: 5 s\nsteps:\n  - &look\n    wait: ${far}\n    phase: look\n"
      "  - *look\n  - {<<: *look, phase: again}\n  - repeat: {times: 2, steps: [*look]}\n",
      "p.yaml", {{"far", "7 s"}});
  REQUIRE(p.steps.size() == 5);
  CHECK(std::get<Wait>(p.steps[2].verb).duration == 7);
  CHECK(p.steps[2].phase == "again");
  const Procedure again = parse_procedure(p.text, "q.yaml");
  CHECK(std::get<Wait>(again.steps[4].verb).duration == 7);
  CHECK(again.text == p.text);
}

TEST_CASE("long texts end in an error, not in a crash") {
  const std::string many(300000, 'a');
  CHECK(error_of_steps("  - annotate: ${" + many + "}\n").find("is not defined") !=
        std::string::npos);
  CHECK(error_of_steps("  - wait_until: " + many + "\n").find("expected a condition") !=
        std::string::npos);
  CHECK_FALSE(error_of_steps("  - sweep:\n      " + many + ": [1 s]\n      steps:\n" +
                             "        - wait: 1 s\n")
                  .empty());
  CHECK_NOTHROW(parsed_steps("  - sweep:\n      a: {from: 1." + std::string(300000, '0') +
                             " s, to: 1 s, step: 1 s}\n      steps:\n        - wait: 1 s\n"));
}
