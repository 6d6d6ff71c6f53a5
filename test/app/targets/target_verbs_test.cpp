// SPDX-License-Identifier: BSD-3-Clause
// What `berth target` makes, checks, draws and writes.
#include "app/targets/new_target.h"
#include "app/targets/target_report.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/targets/target.h"
#include "evaluation/targets/write_measured.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using Catch::Matchers::Contains;

namespace {

/// A body of two groups and a plate apart from it.
constexpr char obj[] =
    "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
    "v 2 0 0\nv 3 0 0\nv 3 1 0\nv 2 1 0\n"
    "g body\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
    "g solar_array\nf 9 10 11 12\n";

std::string without_groups() {
  std::string text = obj;
  for (const char* line : {"g body\n", "g solar_array\n"}) {
    text.erase(text.find(line), std::string(line).size());
  }
  return text;
}

Target made(const TemporaryDirectory& directory, const std::string& mesh, double length = 0) {
  write_file(directory.path() / "my sat.obj", mesh);
  make_target(directory.path() / "my sat.obj", directory.path() / "sat", length);
  return load_target((directory.path() / "sat").string(), 0);
}

}  // namespace

TEST_CASE("a new target's parts are the mesh's groups, or what hangs together") {
  TemporaryDirectory directory;
  SECTION("groups") {
    const Target target = made(directory, obj);
    REQUIRE(target.parts.size() == 3);
    CHECK(target.parts[1].name == "body");
    CHECK(target.parts[2].name == "solar_array");
    CHECK(target.part(12).name == "solar_array");
  }
  SECTION("pieces") {
    const Target target = made(directory, without_groups(), 6);
    REQUIRE(target.parts.size() == 3);
    CHECK(target.part(0).name == "part_1");
    CHECK(target.part(13).name == "part_2");
    CHECK(target.length == Approx(6));
  }
  SECTION("one piece: the default part is all of it") {
    const Target target = made(directory, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    CHECK(target.parts.size() == 1);
  }
}

TEST_CASE("a new target never takes the place of one that is there") {
  TemporaryDirectory directory;
  made(directory, obj);
  write_file(directory.path() / "sat/target.yaml", "mine");
  CHECK_THROWS_WITH(make_target(directory.path() / "my sat.obj", directory.path() / "sat", 0),
                    Contains("is there already"));
  CHECK(read_file(directory.path() / "sat/target.yaml") == "mine");
}

TEST_CASE("a description is shown with its validation notes") {
  TemporaryDirectory directory;
  made(directory, obj);
  const auto file = directory.path() / "sat/target.yaml";
  const auto notes = [&](const std::string& port) {
    write_file(file, "mesh: my sat.obj\nlength: 3 m\ndocking: {aft: {pose: " + port +
                         ", approach_cone: 20 deg}}\nparts: {array: {group: solar_array, "
                         "scan: prefer, joint: {axis: [1, 0, 0], point: [2 m, 500 mm, 0 mm], "
                         "range: [-10 deg, 30 deg]}}}\n");
    std::string all;
    for (const auto& text : validation_notes(load_target((directory.path() / "sat").string(), 0))) {
      all += text + "\n";
    }
    return all;
  };
  CHECK_THAT(notes("[500, 500, 1000, 0, 0, 0]"), !Contains("port"));
  CHECK_THAT(notes("[500, 500, 1000, 180, 0, 0]"), Contains("inside") || Contains("looks into"));
  CHECK_THAT(notes("[500, 500, 500, 0, 0, 0]"), Contains("inside of the surface"));
  CHECK_THAT(notes("[500, 500, 2500, 180, 0, 0]"),
             Contains("looks into the surface") && Contains("1500 mm away"));
  const Target target = load_target((directory.path() / "sat").string(), 0);
  const std::string report = report_of(target);
  CHECK_THAT(report, Contains("array") && Contains("prefer") && Contains("joint of 'array'") &&
                         Contains("-10.0 to 30.0 deg") && Contains("port 'aft'") &&
                         Contains("cone 20 deg"));
  const std::string svg = draw(target);
  CHECK_THAT(svg, Contains("from +x") && Contains("from -z") && Contains(">aft<") &&
                      Contains("prefer (green stripes)") && Contains("turns -10 to 30 deg"));
}

TEST_CASE("measured values replace their keys, and all else stays") {
  const std::string yaml =
      "# mine\nmesh: a.obj\nlength: 3 m\ndefault_part: {reflectivity: 0.5}  # paint\nparts:\n"
      "  bus:\n    # crinkled\n    group: bus\n    surface_sigma: 8 mm   # a guess\n"
      "  array: {group: array, joint: {axis: [1, 0, 0], range: [-9 deg, 9 deg]}}\n";
  targets::PartMeasurement paint;
  paint.part = "default";
  paint.surface_sigma = targets::Measured{0.0004, 0};
  targets::PartMeasurement bus;
  bus.part = "bus";
  bus.surface_sigma = targets::Measured{0.0062, 0};
  bus.correlation_length = targets::Measured{0.11, 0};
  targets::PartMeasurement array;
  array.part = "array";
  array.reflectivity = targets::Measured{0.314, 0};
  array.joint_angle = targets::Measured{radians(2.5), 0};
  CHECK(targets::with_measured(yaml, "target.yaml", {paint, bus, array}) ==
        "# mine\nmesh: a.obj\nlength: 3 m\n"
        "default_part: {surface_sigma: 0.40 mm, reflectivity: 0.5}  # paint\nparts:\n"
        "  bus:\n    # crinkled\n    correlation_length: 110 mm\n    group: bus\n"
        "    surface_sigma: 6.20 mm   # a guess\n"
        "  array: {reflectivity: 0.314, group: array, joint: {rest: 2.50 deg, axis: [1, 0, 0], "
        "range: [-9 deg, 9 deg]}}\n");
}
