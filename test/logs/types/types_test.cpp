// SPDX-License-Identifier: BSD-3-Clause
#include <berth/node_status_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <berth/scan_packet_t.hpp>
#include <berth/testbed_command_t.hpp>
#include <filesystem>
#include <fstream>
#include <other/lab/survey_t.hpp>
#include <random>
#include <regex>

#include "common/core/error.h"
#include "common/core/file.h"
#include "logs/types/lcm_parser.h"
#include "logs/types/type_catalogue.h"
#include "logs/types/value.h"
#include "test/catch.h"
#include "test/logs/file/made_log.h"
#include "test/logs/generated_types.h"

using namespace berth;
using namespace berth::logs;

namespace {

TypeCatalogue all_types() {
  TypeCatalogue types;
  types.add("lcmtypes");
  types.add("test/logs/types/foreign");
  return types;
}

other::lab::survey_t survey(int depth = 1) {
  other::lab::survey_t m{};
  m.rows = 2;
  m.count = 3;
  m.speed = 0.25F;
  for (int i = 0; i < 6; ++i) m.fixed[i / 3][i % 3] = i + 0.5;
  m.grid = {{1, -2, 3}, {4, 5, 6}};
  m.mixed.resize(2);
  m.corners.resize(2);
  m.mixed[0] = {-1, INT64_MAX};
  m.mixed[1] = {0, INT64_MIN};
  m.origin = {1, 2, 200};
  m.corners[0] = {{1, 1, 1}, {2, 2, 2}};
  m.corners[1] = {{3, 3, 3}, {4, 4, 4}};
  m.names = {"", "b", "long \xc3\xa9"};
  m.good = 1;
  m.flags[2] = 1;
  m.parts.resize(3);
  for (auto& part : m.parts) {
    part.mixed.resize(2);
    part.corners.resize(2);
    if (depth > 0) part = survey(depth - 1);
  }
  return m;
}

std::string fault_of(const std::string& text) {
  TypeCatalogue types;
  try {
    types.add_text(text, "bad.lcm");
  } catch (const InputError& e) {
    return e.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("fingerprints are those of lcm-gen, for every type of ours and a foreign one") {
  const TypeCatalogue types = all_types();
  const auto generated = generated_fingerprints();
  CHECK(generated.size() + 2 == types.types().size());
  for (const auto& [name, fingerprint] : generated) {
    INFO(name);
    const StructType* type = types.by_name("berth." + name);
    REQUIRE(type != nullptr);
    CHECK(type->fingerprint == static_cast<std::uint64_t>(fingerprint));
    // No two of our types decode into each other.
    CHECK(types.by_fingerprint(type->fingerprint) == type);
  }
  CHECK(types.by_name("other.lab.survey_t")->fingerprint ==
        static_cast<std::uint64_t>(other::lab::survey_t::getHash()));
  CHECK(types.by_name("other.lab.point_t")->fingerprint ==
        static_cast<std::uint64_t>(other::lab::point_t::getHash()));
}

TEST_CASE("a message of a foreign type is read as its own class would") {
  const TypeCatalogue types = all_types();
  const auto bytes = encoded(survey());
  const StructType* type = types.type_of(bytes);
  REQUIRE(type != nullptr);
  CHECK(type->name == "other.lab.survey_t");
  const auto value = decode_value(*type, bytes);
  REQUIRE(value);
  const auto json = json_of(*type, *value);
  CHECK(json["speed"] == 0.25);
  CHECK(json["fixed"].dump() == "[[0.5,1.5,2.5],[3.5,4.5,5.5]]");
  CHECK(json["grid"].dump() == "[[1,-2,3],[4,5,6]]");
  CHECK(json["mixed"][1][1] == INT64_MIN);
  CHECK(json["origin"].dump() == R"({"x":1.0,"y":2.0,"tag":200})");
  CHECK(json["corners"][1][0]["tag"] == 3);
  CHECK(json["names"][2] == "long \xc3\xa9");
  CHECK(json["good"] == true);
  CHECK(json["flags"].dump() == "[false,false,true,false]");
  CHECK(json["parts"].size() == 3);
  CHECK(json["parts"][2]["names"][1] == "b");
  CHECK(json.begin().key() == "rows");
}

TEST_CASE("no damage makes the decoder throw, and what it takes is a message of its class") {
  const TypeCatalogue types = all_types();
  std::mt19937 random(11);
  const auto good = encoded(survey());
  const StructType& type = *types.type_of(good);
  for (std::size_t length = 0; length < good.size(); ++length) {
    CHECK_FALSE(is_message(type, Bytes(good).first(length)));
  }
  int taken = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    auto bytes = good;
    for (int n = 1 + trial % 3; n > 0; --n) bytes[random() % bytes.size()] ^= 1U << random() % 8;
    const auto value = decode_value(type, bytes);
    CHECK(value.has_value() == is_message(type, bytes));
    if (!value) continue;
    ++taken;
    other::lab::survey_t message{};
    REQUIRE(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) ==
            static_cast<int>(bytes.size()));
  }
  CHECK(taken > 1000);  // a flipped digit is no damage that a decoder can see
}

TEST_CASE("sizes that nothing could hold end at once") {
  TypeCatalogue types;
  types.add_text("struct empty_t { } struct t { int32_t n; empty_t e[n]; t tree[n]; }", "t.lcm");
  const StructType& type = *types.by_name("t");
  std::vector<std::uint8_t> bytes(12, 0);
  for (int i = 0; i < 8; ++i) {
    bytes[static_cast<std::size_t>(i)] =
        static_cast<std::uint8_t>(type.fingerprint >> (56 - 8 * i));
  }
  CHECK(is_message(type, bytes));
  bytes[8] = 0x7f;
  CHECK_FALSE(decode_value(type, bytes));
  bytes[8] = 0xff;
  CHECK_FALSE(decode_value(type, bytes));
  // A chain of structs in structs, deeper than any stack: refused, not followed.
  bytes.resize(12 + 400000, 0);
  for (std::size_t at = 8; at + 4 <= bytes.size(); at += 4) bytes[at + 3] = 1;
  CHECK_FALSE(decode_value(type, bytes));
}

TEST_CASE("units come from names, and from comments where the name has none") {
  CHECK(unit_of("utime", "") == "us");
  CHECK(unit_of("lease_utime_expires", "") == "us");
  CHECK(unit_of("position_m", "") == "m");
  CHECK(unit_of("linear_velocity_m_s", "") == "m/s");
  CHECK(unit_of("field_of_view_rad", "full width") == "rad");
  CHECK(unit_of("rate_hz", "") == "Hz");
  CHECK(unit_of("time_us", "after utime") == "us");
  CHECK(unit_of("reported_joint", "rad, linear axes m") == "rad");
  CHECK(unit_of("x", "from the left [mm]") == "mm");
  CHECK(unit_of("distance", "metres, always") == "m");
  CHECK(unit_of("covariance", "row-major, [translation (m); rotation]").empty());
  CHECK(unit_of("from", "modules").empty());
  const TypeCatalogue types = all_types();
  const StructType& survey = *types.by_name("other.lab.survey_t");
  CHECK(survey.field("speed")->comment == "above the line: m/s");
  CHECK(survey.field("fixed")->unit == "rad");
  CHECK(types.by_name("other.lab.point_t")->field("y")->unit == "mm");
  CHECK(types.by_name("other.lab.point_t")->comment == "A block of lines.");
  REQUIRE(survey.constants.size() == 2);
  CHECK(survey.constants[1].text == "0x10");
}

TEST_CASE("what is wrong in a .lcm file is named with its line") {
  using Catch::Matchers::Contains;
  CHECK_THAT(fault_of("struct t {\n int32_t n\n}"), Contains("bad.lcm:3: found '}', expected ';'"));
  CHECK_THAT(fault_of("struct t {\n double a[m];\n}"), Contains("bad.lcm:2: found 'm'"));
  CHECK_THAT(fault_of("struct t {\n double m; double a[m];\n}"), Contains("found 'm'"));
  CHECK_THAT(fault_of("struct t {\n double a[0];\n}"), Contains("found '0'"));
  CHECK_THAT(fault_of("struct t {\n other_t a;\n}"), Contains("found 'other_t a'"));
  CHECK_THAT(fault_of("struct t { int8_t a;\n int8_t a; }"),
             Contains("bad.lcm:2: found 'a' a second"));
  CHECK_THAT(fault_of("struct t { } struct t { }"), Contains("a second type t"));
  CHECK_THAT(fault_of("enum e { A }"), Contains("enum"));
  CHECK_THAT(fault_of("struct t { int8_t a; }\n/* no end"), Contains("bad.lcm:2"));
  CHECK_THAT(fault_of("struct t { const string A = 1; }"), Contains("'string'"));
  CHECK_THAT(fault_of("struct t { int8_t 9a; }"), Contains("'9a'"));
  CHECK_THAT(fault_of("struct t { int8_t a; "), Contains("end of the file"));
  CHECK_THROWS_AS(TypeCatalogue().add("/nonexistent.lcm"), InputError);
}
