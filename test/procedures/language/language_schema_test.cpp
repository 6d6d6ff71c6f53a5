// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "common/core/error.h"
#include "common/core/file.h"
#include "procedures/language/blocks.h"
#include "procedures/language/procedure.h"
#include "procedures/language/schema.h"
#include "procedures/language/step_options.h"
#include "test/catch.h"
#include "test/procedures/language/parsed.h"

using namespace berth;
using namespace berth::procedures;

namespace {

std::string example(const KeyInfo& key) {
  switch (key.kind) {
    case Kind::number:
      return "50 %";
    case Kind::length:
      return "4 m";
    case Kind::angle:
      return "2 deg";
    case Kind::time:
      return "3 s";
    case Kind::speed:
      return "5 mm/s";
    case Kind::angular_speed:
      return "1 deg/s";
    case Kind::quantity:
      return "30 mm";
    case Kind::count:
      return "2";
    case Kind::boolean:
      return "true";
    case Kind::texts:
      return key.key == "frozen" ? "[none]" : "[go]";
    case Kind::words:
      return key.key == "fault" ? "range_bias" : key.words.front();  // one that has a size
    case Kind::pose:
      return "[0, 0, 5000, 0, 0, 0]";
    case Kind::poses:
      return "[[0, 0, 5000, 0, 0, 0]]";
    case Kind::trajectory:
      return "{drift: {duration: 10 s}}";
    case Kind::gate:
      return "[3 m, 8 m]";
    case Kind::values:
      return "[1 s, 2 s]";
    case Kind::live:
      return "clearance";
    case Kind::condition:
      return "estimate is ok";
    case Kind::steps:
      return "[{wait: 1 s}]";
    default:
      return "go";
  }
}

std::string all_keys(const std::vector<KeyInfo>& keys) {
  std::string text;
  for (const KeyInfo& key : keys)
    text += (text.empty() ? "" : ", ") + key.key + ": " + example(key);
  return "{" + text + "}";
}

}  // namespace

TEST_CASE("the schema that ships is that of the parser") {
  INFO("berth check --schema > procedures/schema.json writes it anew");
  CHECK((read_file("procedures/schema.json") == json_schema()));
}

TEST_CASE("the parser has every key of its tables") {
  for (const auto* table : {&verbs(), &blocks()}) {
    for (const VerbInfo& verb : *table) {
      // Of the rules of a trajectory only one may be given; a call needs a file.
      if (verb.name == "trajectory" || verb.name == "call" || verb.keys.empty()) continue;
      INFO(verb.name << ": " << all_keys(verb.keys));
      CHECK_NOTHROW(parsed_step(verb.name + ": " + all_keys(verb.keys)));
    }
  }
  for (const VerbInfo& verb : verbs()) {
    if (!verb.value) continue;
    INFO(verb.name);
    CHECK_NOTHROW(parsed_step(verb.name + ": " + example({"", *verb.value, false, "", ""})));
  }
  std::string step = "wait: 1 s";
  for (const KeyInfo& key : step_keys()) {
    const bool words = key.key == "on_failure";
    step += "\n    " + key.key + ": " + (words ? "retry 2 times" : example(key));
  }
  CHECK_NOTHROW(parsed_step(step));
  CHECK_NOTHROW(parse_procedure("name: t\nsteps:\n  - wait: 1 s\n    phase: go\nlimits:\n  - " +
                                    all_keys(limit_keys()) + "\n",
                                "p.yaml"));
}

TEST_CASE("keys that must be given are missed by the parser too") {
  for (const VerbInfo& verb : verbs()) {
    if (verb.name == "trajectory") continue;
    for (const KeyInfo& left_out : verb.keys) {
      auto keys = verb.keys;
      keys.erase(std::find_if(keys.begin(), keys.end(),
                              [&](const KeyInfo& k) { return k.key == left_out.key; }));
      INFO(verb.name << " without " << left_out.key);
      if (left_out.required) {
        CHECK_THROWS_AS(parsed_step(verb.name + ": " + all_keys(keys)), InputError);
      } else {
        CHECK_NOTHROW(parsed_step(verb.name + ": " + all_keys(keys)));
      }
    }
  }
}

TEST_CASE("the operator's page names everything there is") {
  const std::string page = read_file("docs/procedures.md");
  const auto check = [&page](const std::string& name) {
    INFO(name);
    CHECK(page.find("`" + name + "`") != std::string::npos);
  };
  for (const auto* table : {&verbs(), &blocks()}) {
    for (const VerbInfo& verb : *table) {
      check(verb.name);
      if (verb.name == "trajectory" || verb.name == "sweep") continue;
      for (const KeyInfo& key : verb.keys) check(key.key);
    }
  }
  for (const KeyInfo& key : step_keys()) check(key.key);
  for (const KeyInfo& key : limit_keys()) check(key.key);
  for (const LiveQuantity& quantity : live_quantities()) check(quantity.name);
}
