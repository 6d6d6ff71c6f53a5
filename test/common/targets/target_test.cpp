// SPDX-License-Identifier: BSD-3-Clause
#include "common/targets/target.h"

#include <nlohmann/json.hpp>
#include <set>

#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/targets/target_file.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using Catch::Matchers::Contains;

namespace {

/// A bus of 1 x 1 x 1 m with an array of 2 x 0.5 m next to it that is hinged at x = 0.5 m, all in
/// millimetres; the array's inner corners are the bus's own vertices.
const char* const satellite_obj =
    "g bus\n"
    "v -500 -250 0\nv 500 -250 0\nv 500 250 0\nv -500 250 0\n"
    "f 1 2 3\nf 1 3 4\n"
    "g array\n"
    "v 2500 -250 0\nv 2500 250 0\n"
    "f 2 5 6\nf 2 6 3\n";

const char* const satellite_yaml = R"(mesh: satellite.obj
length: 3 m
mount: {pose: [0, 0, 400, 0, 0, 0]}
docking:
  aft: {pose: [0, 0, -100, 180, 0, 0], approach_cone: 15 deg}
  side: {pose: [-500, 0, 0, 0, -90, 0]}
default_part: {surface_sigma: 1 mm, correlation_length: 200 mm, reflectivity: 0.4}
parts:
  array:
    group: array
    surface_sigma: 2 mm
    scan: avoid
    joint: {axis: [0, 2, 0], point: [500 mm, 0 mm, 0 mm], range: [-20 deg, 90 deg]}
)";

struct Folder {
  TemporaryDirectory directory;
  explicit Folder(const std::string& yaml, const std::string& obj = satellite_obj) {
    write_file(directory / "satellite.obj", obj);
    write_file(directory / target_file, yaml);
  }
  Target load(double length = 0) const { return load_target(directory.path().string(), length); }
};

/// The description with one text in place of another.
std::string changed(const std::string& from, const std::string& to) {
  std::string text = satellite_yaml;
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

}  // namespace

TEST_CASE("a target's folder describes its parts, joints and ports") {
  const Folder folder(satellite_yaml);
  const Target target = folder.load();
  CHECK(target.length == Approx(3));
  REQUIRE(target.parts.size() == 2);
  CHECK(target.parts[0].name == "default");
  CHECK(target.parts[0].surface_sigma == Approx(0.001));
  CHECK(target.parts[1].name == "array");
  CHECK(target.parts[1].surface_sigma == Approx(0.002));
  CHECK(target.parts[1].correlation_length == Approx(0.2));  // as in the default part
  CHECK(target.parts[1].material.reflectivity == Approx(0.4));
  CHECK(target.parts[1].scan == ScanPreference::avoid);
  REQUIRE(target.parts[1].joint);
  CHECK(target.parts[1].joint->axis.isApprox(Vector3d::UnitY()));
  CHECK(target.parts[1].joint->high == Approx(radians(90)));
  CHECK(target.parts[1].joint->rest == 0);
  CHECK(target.part_of == std::vector<std::uint16_t>{0, 0, 1, 1});
  REQUIRE(target.ports.size() == 2);
  CHECK(target.port()->name == "aft");
  CHECK(target.port("side")->approach_cone == Approx(radians(60)));
  CHECK((target.port("side")->pose.rotation * Vector3d::UnitZ()).isApprox(-Vector3d::UnitX()));
  CHECK(target.port("fore") == nullptr);
  REQUIRE(target.mount);
  CHECK(target.mount->position.z() == Approx(0.4));
  CHECK_FALSE(target.description_hash.empty());
}

TEST_CASE("another length scales mesh, ports, joints and mount, no sigma") {
  const Folder folder(satellite_yaml);
  const Target half = folder.load(1.5);
  CHECK(half.length == Approx(1.5));
  CHECK(half.port()->pose.position.z() == Approx(-0.05));
  CHECK(half.parts[1].joint->point.x() == Approx(0.25));
  CHECK(half.mount->position.z() == Approx(0.2));
  CHECK(half.parts[1].surface_sigma == Approx(0.002));
  const auto ports = read_ports(satellite_yaml, "target.yaml", 1.5);
  REQUIRE(ports.size() == 2);
  CHECK(ports[0].pose.position.isApprox(half.port()->pose.position));
}

TEST_CASE("a joint at another rest angle turns its part alone, about its axis") {
  const Folder folder(changed("range: [-20 deg, 90 deg]", "range: [0 deg, 90 deg], rest: 90 deg"));
  const Target target = folder.load();
  const Box box = bounding_box(target.mesh);
  CHECK(box.low.z() == Approx(-2));  // the tip, 2 m from the hinge, went from +x to -z
  CHECK(box.high.x() == Approx(0.5));
  CHECK(target.mesh.vertices.size() == 8);  // the corners that were the bus's too are two each now
  const Mesh back = turned_mesh(target, {0, radians(-90)});
  CHECK(bounding_box(back).high.x() == Approx(2.5));
  const Box swept = bounding_box(swept_mesh(target));
  CHECK(swept.low.z() == Approx(-2));
  CHECK(swept.high.x() == Approx(2.5));
}

TEST_CASE("the first part that names a face has it") {
  const Folder folder(changed("parts:\n", "parts:\n  inner: {faces: [2]}\n"));
  const Target target = folder.load();
  CHECK(target.part_of == std::vector<std::uint16_t>{0, 0, 1, 2});
}

TEST_CASE("a description that is wrong is refused with file, line and key") {
  const auto refused = [](const std::string& yaml, const std::string& with) {
    const Folder folder(yaml);
    CHECK_THROWS_WITH(folder.load(), Contains(with) && Contains(std::string(target_file) + ":"));
  };
  refused(changed("length: 3 m\n", ""), "key 'length': is missing");
  refused(changed("length: 3 m", "length: 0 m"),
          "key 'length': found '0 m', expected a length above 0");
  refused(changed("satellite.obj", "../satellite.obj"), "expected a file next to target.yaml");
  refused(changed("group: array", "group: wing"), "has no group 'wing'; it has");
  refused(changed("group: array", "box: {low: [1 m, 1 m, 1 m], high: [2 m, 2 m, 2 m]}"),
          "key 'parts.array.box': no face of the mesh has its centre in it");
  refused(changed("group: array", "faces: [2-4]"), "expected indices of triangles from 0 to 3");
  refused(changed("group: array", "faces: [x]"), "key 'parts.array.faces': found 'x'");
  refused(changed("group: array", ""), "expected one of 'group', 'box' and 'faces'");
  refused(changed("parts:\n", "parts:\n  wing: {group: array}\n"),
          "key 'parts.array': all its faces are of parts before it");
  refused(changed("scan: avoid", "scan: never"), "expected one of: prefer, avoid");
  refused(changed("axis: [0, 2, 0]", "axis: [0, 0, 0]"), "expected a direction");
  refused(changed("range: [-20 deg, 90 deg]", "range: [90 deg, -20 deg]"), "joint.range");
  refused(changed("15 deg", "120 deg"), "expected an angle above 0 and at most 90 deg");
  refused(changed("reflectivity: 0.4", "reflectivity: 4"), "expected a number from 0 to 1");
  refused(changed("surface_sigma: 2 mm", "sigma: 2 mm"), "is not known here");
}

TEST_CASE("a target is found by name, folder, description or mesh; a copy is the same") {
  const Folder folder(satellite_yaml);
  CHECK(find_target("radarsat2").filename() == "radarsat2");
  CHECK(is_target_name("radarsat2"));
  CHECK_FALSE(is_target_name(folder.directory.path().string()));
  CHECK(find_target((folder.directory / target_file).string()) == folder.directory.path());
  CHECK_THROWS_WITH(find_target("radarsat3"), Contains("a name of targets/ (radarsat2"));
  CHECK_THROWS_WITH(find_target("common"), Contains("has no target.yaml"));
  TemporaryDirectory run;
  const Target target = folder.load();
  const auto kept = copy_target(target, run / "target");
  const Target again = load_target(kept.string(), 0);
  CHECK(again.name == target.name);
  CHECK(again.hash == target.hash);
  CHECK(again.description_hash == target.description_hash);
}

TEST_CASE("the editor's schema has the keys that a description can have, and no other") {
  using nlohmann::json;
  const json schema = json::parse(read_file("targets/schema.json"));
  // With every key there is, and read without complaint.
  std::string all = satellite_yaml;
  all.replace(all.find("default_part:"), std::string::npos,
              "default_part: {surface_sigma: 1 mm, correlation_length: 2 m, reflectivity: 0.1, "
              "specular: 0.1, roughness: 1 deg, scan: none}\n"
              "parts:\n"
              "  a: {faces: [0], surface_sigma: 1 mm, correlation_length: 2 m, reflectivity: 0.1, "
              "specular: 0.1, roughness: 1 deg, scan: prefer}\n"
              "  b: {box: {low: [-1 m, -1 m, -1 m], high: [0.4 m, 1 m, 1 m]}}\n"
              "  c: {group: array, joint: {axis: [0, 1, 0], point: [0 m, 0 m, 0 m], "
              "range: [0 deg, 9 deg], rest: 1 deg}}\n");
  CHECK_NOTHROW(Folder(all).load());
  const auto keys_of_schema = [](const json& object) {
    std::set<std::string> keys;
    for (const auto& [key, value] : object.at("properties").items()) keys.insert(key);
    return keys;
  };
  Config description = Config::parse(all, "all");
  const auto keys_of = [](const Config& config) {
    const auto keys = config.keys();
    return std::set<std::string>(keys.begin(), keys.end());
  };
  CHECK(keys_of_schema(schema) == keys_of(description));
  const json& properties = schema.at("properties");
  CHECK(keys_of_schema(properties.at("default_part")) ==
        keys_of(description.section("default_part")));
  CHECK(keys_of_schema(properties.at("mount")) == keys_of(description.section("mount")));
  CHECK(keys_of_schema(properties.at("docking").at("additionalProperties")) ==
        keys_of(description.section("docking").section("aft")));
  const json& part = properties.at("parts").at("additionalProperties");
  Config parts = description.section("parts");
  std::set<std::string> of_parts;
  for (const char* name : {"a", "b", "c"}) of_parts.merge(keys_of(parts.section(name)));
  CHECK(keys_of_schema(part) == of_parts);
  CHECK(keys_of_schema(part.at("properties").at("joint")) ==
        keys_of(parts.section("c").section("joint")));
  CHECK(keys_of_schema(part.at("properties").at("box")) ==
        keys_of(parts.section("b").section("box")));
}
