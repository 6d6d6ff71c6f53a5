// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/config.h"

#include "common/core/renamed_keys.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using Catch::Contains;

namespace {

/// The reader's error for this text when read as a lidar's configuration.
std::string error_of(const std::string& text) {
  try {
    Config config = Config::parse(text, "lidar.yaml");
    config.quantity("range_min", Dimension::length);
    Config beam = config.section("beam");
    beam.quantity("divergence", Dimension::angle);
    beam.finish();
    config.finish();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a good file reads in SI units") {
  Config config = Config::parse(
      "speed: 20 mm/s\nangle: 90 deg\nshare: 25 %\ncount: 7\non: true\n"
      "pose: [100, -230, 8000, 25, 20, -30]\n",
      "x.yaml");
  CHECK(config.quantity("speed", Dimension::speed) == Approx(0.02));
  CHECK(config.quantity("angle", Dimension::angle) == Approx(1.5707963267948966));
  CHECK(config.number("share") == Approx(0.25));
  CHECK(config.integer("count") == 7);
  CHECK(config.boolean("on"));
  CHECK(config.pose("pose").position.z() == Approx(8.0));
  CHECK_NOTHROW(config.finish());
}

TEST_CASE("a path is relative to its file, and something is there") {
  const TemporaryDirectory directory;
  std::filesystem::create_directories(directory / "runs");
  const auto read = [&](const std::string& text) {
    Config config = Config::parse(text, (directory / "plan.yaml").string());
    std::filesystem::path path = "otherwise";
    config.optional("runs", path);
    return path;
  };
  CHECK(read("runs: runs") == directory / "runs");
  CHECK(read("runs: ./runs/../runs") == directory / "runs");
  CHECK(read("name: x") == "otherwise");
  CHECK_THROWS_WITH(read("a: 1\nruns: none"),
                    Contains("plan.yaml:2: key 'runs'") && Contains("found 'none'"));
  CHECK_THROWS_WITH(read("runs: ''"), Contains("plan.yaml:1: key 'runs'") && Contains("found ''"));
}

TEST_CASE("bad input names file, line, key, what was found and what was expected") {
  CHECK(error_of("range_min: 3 m\nbeam:\n  divergence: 0.17 mrad\n").empty());
  CHECK(error_of("range_min: 3\nbeam: {divergence: 1 deg}\n") ==
        "lidar.yaml:1: key 'range_min': found '3', expected a length such as '5.5 m' or '30 mm'");
  CHECK(error_of("range_min: 3 m\nbeam:\n  divergence: 1 s\n")
            .rfind("lidar.yaml:3: key 'beam.divergence': found '1 s', expected an angle", 0) == 0);
  CHECK(error_of("range_min: 3 m\nbeam:\n  divergence: 1 deg\n  divergance: 2 deg\n") ==
        "lidar.yaml:4: key 'beam.divergance': is not known here; did you mean 'divergence'?");
  CHECK(error_of("range_min: 3 m\n") == "lidar.yaml:1: key 'beam': is missing");
  CHECK(error_of("range_min: 3 m\nrange_min: 4 m\nbeam: {divergence: 1 deg}\n")
            .rfind("lidar.yaml:2: key 'range_min' appears twice", 0) == 0);
  CHECK(error_of("range_min: [3 m\n").rfind("lidar.yaml:", 0) == 0);
  CHECK(error_of("- 1\n- 2\n") == "lidar.yaml:1: found a list of 2, expected a map of keys");
  CHECK(error_of("range_min: nan m\nbeam: {divergence: 1 deg}\n").find("expected a length") !=
        std::string::npos);
}

TEST_CASE("words outside a choice and wrong types are refused") {
  Config config = Config::parse("pattern: zigzag\ncount: many\npose: [1, 2, 3]\n", "x.yaml");
  CHECK_THROWS_WITH(config.choice("pattern", {"raster", "spiral"}),
                    "x.yaml:1: key 'pattern': found 'zigzag', expected one of: raster, spiral");
  CHECK_THROWS_WITH(config.integer("count"),
                    "x.yaml:2: key 'count': found 'many', expected a whole number");
  CHECK_THROWS_WITH(config.pose("pose"),
                    "x.yaml:3: key 'pose': found a list of 3, expected [x, y, z, w, p, r] in mm "
                    "and degrees");
  CHECK_THROWS_AS(Config::load("/nonexistent.yaml"), InputError);
}

TEST_CASE("whole numbers are read as people write them, and refused out of their range") {
  const auto read = [](const std::string& text) {
    return Config::parse("n: " + text + "\n", "x.yaml").integer("n");
  };
  CHECK(read("010") == 10);
  CHECK(read("0500") == 500);
  CHECK(read("-007") == -7);
  CHECK(read("+5") == 5);
  CHECK(read("0x1F") == 31);
  CHECK(read("0o17") == 15);
  CHECK(read("1e3") == 1000);
  CHECK(read("3.0") == 3);
  CHECK(read("-9223372036854775808") == std::numeric_limits<std::int64_t>::min());
  for (const char* wrong : {"1_000", "1,000", "3.5", "0b11", "1e30", "nan", ".inf", "0x", "--3",
                            "+-3", "9223372036854775808", "5 m", "''", "0x1.8p1", "1e-1"}) {
    INFO(wrong);
    CHECK_THROWS_WITH(read(wrong), Catch::Matchers::Contains("x.yaml:1: key 'n': found") &&
                                       Catch::Matchers::Contains("expected a whole number"));
  }
  int small = 7;
  Config config = Config::parse("n: 4294967796\nm: -5000000000\nk: [010, 0x10]\n", "x.yaml");
  CHECK_THROWS_WITH(config.optional("n", small),
                    "x.yaml:1: key 'n': found '4294967796', expected a whole number from "
                    "-2147483648 to 2147483647");
  CHECK_THROWS_AS(config.small_integer("m"), InputError);
  CHECK(small == 7);
  CHECK(config.integers("k") == std::vector<std::int64_t>{10, 16});
}

TEST_CASE("quantities are finite and have one sign") {
  for (const char* wrong : {"1e308 km", "+-5 m", "inf m", "nan m", "0x10 m", "1_000 m", "1,5 m"}) {
    INFO(wrong);
    CHECK_THROWS_AS(parse_quantity(wrong, Dimension::length), InputError);
  }
  CHECK(parse_quantity("+010 mm", Dimension::length) == Approx(0.01));
}

TEST_CASE("Bounds are checked where a key is read, and reported in one form") {
  const auto refused = [](const std::string& value, Dimension dimension,
                          const ValueBounds& bounds) {
    Config config = Config::parse("a:\n  b: " + value + "\n", "x.yaml");
    Config section = config.section("a");
    double read = 0;
    try {
      section.optional("b", dimension, read, bounds);
    } catch (const InputError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK(refused("0 m", Dimension::length, above(0)) ==
        "x.yaml:2: key 'a.b': found '0 m', expected a length above 0");
  CHECK(refused("-1 %", Dimension::number, within(0, 1)) ==
        "x.yaml:2: key 'a.b': found '-1 %', expected a number from 0 to 1");
  CHECK(refused("90 %", Dimension::number, above(0).below(0.9)) ==
        "x.yaml:2: key 'a.b': found '90 %', expected a number above 0 and below 0.9");
  CHECK(refused("0.5 mm", Dimension::length, at_least(0.001)) ==
        "x.yaml:2: key 'a.b': found '0.5 mm', expected a length of at least 1 mm");
  CHECK(refused("2 Hz", Dimension::frequency, ValueBounds{}.at_most(1)) ==
        "x.yaml:2: key 'a.b': found '2 Hz', expected a frequency of at most 1 Hz");
  CHECK(refused("1 mm", Dimension::length, at_least(0.001)).empty());
  CHECK(refused("100 %", Dimension::number, within(0, 1)).empty());
  Config config = Config::parse("n: 0\nbox: [1 m, 0 m, 1 m]\n", "x.yaml");
  CHECK_THROWS_WITH(config.integer("n", at_least(1)),
                    "x.yaml:1: key 'n': found '0', expected a whole number of at least 1");
  CHECK_THROWS_WITH(config.small_integer("n", within(1, 80)),
                    "x.yaml:1: key 'n': found '0', expected a whole number from 1 to 80");
  CHECK_THROWS_WITH(config.vector("box", Dimension::length, above(0)),
                    "x.yaml:2: key 'box': found '0 m', expected a length above 0");
}

TEST_CASE("A choice is read as what its word means, a left out one keeps its value") {
  enum class Side { left, right };
  Config config = Config::parse("a: right\nb: up\n", "x.yaml");
  CHECK(config.choice<Side>("a", {{"left", Side::left}, {"right", Side::right}}) == Side::right);
  Side side = Side::right;
  config.optional_choice("c", side, {{"left", Side::left}, {"right", Side::right}});
  CHECK(side == Side::right);
  CHECK_THROWS_WITH(
      config.optional_choice("b", side, {{"left", Side::left}, {"right", Side::right}}),
      "x.yaml:2: key 'b': found 'up', expected one of: left, right");
}

TEST_CASE("A recorder keeps what each key is, whether the file has it or not") {
  const auto read = [] {
    Config config = Config::parse("rate: 5 Hz\nparts:\n  bus: {kind: b}\nlist: [{n: 3}]\n", "x");
    double rate = 10, share = 0.25;
    config.optional("rate", Dimension::frequency, rate, above(0));
    Config section = config.optional_section("section");
    section.optional("share", share);
    for (auto& [name, part] : config.section("parts").named_sections()) {
      part.choice("kind", {"a", "b"});
    }
    for (Config& item : config.sections("list")) item.small_integer("n", at_least(1));
    config.finish();
  };
  read();  // without one nothing is kept
  std::map<std::string, ConfigKey> keys;
  {
    const ConfigRecorder recorder;
    read();
    for (const ConfigKey& key : recorder.keys()) keys.emplace(key.path, key);
  }
  CHECK(ConfigRecorder::current() == nullptr);
  const ConfigKey& rate = keys.at("rate");
  CHECK(rate.file == "x");
  CHECK_FALSE(rate.required);
  CHECK(rate.default_value == "10 Hz");
  CHECK(rate.value == "5 Hz");
  CHECK(text_of(rate.bounds, rate.dimension) == "above 0");
  CHECK(keys.at("section.share").default_value == "0.25");
  CHECK(keys.at("section.share").value.empty());
  CHECK(keys.at("parts.NAME.kind").words == std::vector<std::string>{"a", "b"});
  CHECK(keys.at("parts.NAME.kind").required);
  CHECK(keys.at("list[].n").kind == ConfigKey::Kind::integer);
}

TEST_CASE("A value is shown in the unit that makes it shortest") {
  CHECK(text_of(0.17e-3, Dimension::angle) == "170 urad");
  CHECK(text_of(radians(5), Dimension::angle) == "5 deg");
  CHECK(text_of(0.035, Dimension::length) == "35 mm");
  CHECK(text_of(1e6, Dimension::frequency) == "1000 kHz");
  CHECK(text_of(0.0025, Dimension::number) == "0.0025");
  CHECK(text_of(60, Dimension::time) == "60 s");
}

TEST_CASE("A key under its former name is an error that names the present one") {
  Config config = Config::parse("scan_planner:\n  least_margin: 20 mm\n", "estimator.yaml");
  Config planner = config.section("scan_planner");
  double margin = 0;
  CHECK_THROWS_WITH(planner.optional("min_margin", Dimension::length, margin),
                    Contains("estimator.yaml:2: key 'scan_planner.least_margin'") &&
                        Contains("'min_margin' now") && Contains("berth config migrate"));
  CHECK_THROWS_WITH(planner.quantity("min_margin", Dimension::length), Contains("'min_margin'"));
  CHECK_THROWS_WITH(planner.finish(), Contains("'min_margin'"));
}

TEST_CASE("Present names replace former ones, and nothing else") {
  std::vector<Renamed> renamed;
  const std::string text =
      "# least_margin is told below\n"
      "scan_planner: {least_margin: 20 mm, \"most_windows\": 24}  # flow\n"
      "tracking:\n"
      "  icp:\n"
      "    least_gate: 35 mm   # at last\n"
      "least_margin: 3   # of another map\n";
  CHECK(with_present_names(text, "estimator.yaml", &renamed) ==
        "# least_margin is told below\n"
        "scan_planner: {min_margin: 20 mm, \"max_windows\": 24}  # flow\n"
        "tracking:\n"
        "  icp:\n"
        "    min_gate: 35 mm   # at last\n"
        "least_margin: 3   # of another map\n");
  REQUIRE(renamed.size() == 3);
  CHECK(renamed[2].line == 5);
  CHECK(renamed[2].before == "tracking.icp.least_gate");
  CHECK(renamed[2].now == "tracking.icp.min_gate");
}
