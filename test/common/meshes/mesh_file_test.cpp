// SPDX-License-Identifier: BSD-3-Clause
#include "common/meshes/mesh_file.h"

#include <clocale>
#include <cmath>
#include <cstring>
#include <numbers>

#include "common/core/error.h"
#include "common/meshes/mesh_builder.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using Catch::Matchers::Contains;

namespace {

template <class Value>
std::string raw(Value value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

template <class Parse>
std::string refusal(Parse parse, const std::string& bytes) {
  try {
    parse(bytes, "m");
  } catch (const InputError& e) {
    return e.what();
  }
  return "read";
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    sum += (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm() / 2;
  }
  return sum;
}

/// A tetrahedron whose first coordinate is x.
std::string binary_tetrahedron(float x) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
  for (const float v : {x, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F}) bytes += raw(v);
  for (const auto& face : {std::array{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}) {
    bytes += '\3';
    for (const int corner : face) bytes += raw(corner);
  }
  return bytes;
}

const std::string text_square = R"(ply
format ascii 1.0
element vertex 4
property double x
property double y
property double z
property list uchar int neighbours
element face 2
property uchar red
property list uchar int vertex_index
element edge 1
property int vertex1
property int vertex2
end_header
0 0 0 0
2 0 0 2 1 3
2 1 0 1 0
0 1 0 0
255 3 0 1 2
0 3 0 2 3
0 1
)";

const std::string square_obj = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\n";

std::string binary_stl(const std::string& header, std::uint32_t facets) {
  std::string bytes = header + std::string(80 - header.size(), ' ') + raw(facets);
  for (std::uint32_t f = 0; f < facets; ++f) {
    for (const float v :
         {0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F + static_cast<float>(f), 0.F}) {
      bytes += raw(v);
    }
    bytes += raw(std::uint16_t{7});
  }
  return bytes;
}

const std::string facet =
    "facet normal 0 0 nan\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\n"
    "endfacet\n";

}  // namespace

TEST_CASE("a binary PLY mesh is read whole, whatever its first byte; cut anywhere it is refused",
          "[mesh]") {
  float first = 0;
  const std::uint32_t line_ends = 0x0D0A0D0A;
  std::memcpy(&first, &line_ends, sizeof first);
  for (const float x : {0.F, first}) {
    const std::string bytes = binary_tetrahedron(x);
    const Mesh mesh = parse_ply_mesh(bytes, "m");
    CHECK(mesh.triangles.size() == 4);
    CHECK(mesh.vertices[0].x() == double{x});
    for (std::size_t n = 0; n < bytes.size(); ++n) {
      INFO(n);
      CHECK_THAT(refusal(parse_ply_mesh, bytes.substr(0, n)), Contains("m:"));
    }
    CHECK_THAT(refusal(parse_ply_mesh, bytes + "x"),
               Contains("byte ") && Contains("1 bytes follow"));
  }
}

TEST_CASE("a text PLY mesh holds what it declares, or is refused by line", "[mesh]") {
  const Mesh mesh = parse_ply_mesh(text_square, "m");
  CHECK(mesh.triangles.size() == 2);
  CHECK(mesh.vertices.size() == 4);
  const auto refused = [](const std::string& from, const std::string& to) {
    return refusal(parse_ply_mesh, replaced(text_square, from, to));
  };
  CHECK_THAT(refused("0 3 0 2 3\n", ""), Contains("m:20: face 1: found 2 values"));
  CHECK_THAT(refused("0 3 0 2 3\n0 1\n", ""),
             Contains("m:19") && Contains("2 rows of 'face' declared, 1 there"));
  CHECK_THAT(refused("3 0 1 2", "0"), Contains("m:19: face 0: a face without corners"));
  CHECK_THAT(refused("3 0 1 2", "3 0 1 4"), Contains("m:19: face 0: vertex 4 of 4 does not exist"));
  CHECK_THAT(refused("3 0 1 2", "3 0 -1 2"), Contains("m:19") && Contains("vertex -1"));
  CHECK_THAT(refused("2 1 0", "2 inf 0"), Contains("m:17: vertex 2: a coordinate is not finite"));
  CHECK_THAT(refused("2 1 0", "2 1e999 0"), Contains("m:17") && Contains("not finite"));
  CHECK_THAT(refused("vertex_index", "corners"), Contains("no list 'vertex_indices'"));
  CHECK_THAT(refused("property list uchar int vertex_index", "property int vertex_index"),
             Contains("m:"));
  CHECK_THAT(refused("double z", "double w"), Contains("no z"));
  CHECK_THAT(refused("element face 2", "element faces 2"),
             Contains("expected 'vertex', and 'face'"));
  CHECK_THAT(
      refusal(parse_ply_mesh,
              "ply\nformat ascii 1.0\nelement face 0\nproperty list uchar int "
              "vertex_index\nelement vertex 0\nproperty float x\nproperty float y\nproperty float "
              "z\nend_header\n"),
      Contains("comes before 'vertex'"));
}

TEST_CASE("triangle strips of PLY alternate their winding and start anew after -1", "[mesh]") {
  const std::string strips =
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float "
      "z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n";
  const Mesh mesh = parse_ply_mesh(strips + "6 0 1 2 3 4 5\n", "m");
  REQUIRE(mesh.triangles.size() == 4);
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    CHECK((mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).z() == Approx(1));
  }
  CHECK(parse_ply_mesh(strips + "9 0 1 2 -1 2 3 4 5 -1\n", "m").triangles.size() == 3);
  // corners that repeat turn a strip, they are no faces
  CHECK(parse_ply_mesh(strips + "7 0 1 2 2 3 4 5\n", "m").faces_without_area == 0);
  CHECK_THAT(refusal(parse_ply_mesh, strips + "3 0 1 6\n"),
             Contains("m:16: tristrips 0: vertex 6"));
}

TEST_CASE("coordinates are read in 64 bits, whatever the locale", "[mesh]") {
  const char* const before = std::setlocale(LC_NUMERIC, nullptr);
  const std::string kept = before == nullptr ? "C" : before;
  for (const char* locale : {"C", "de_DE.UTF-8", "de_DE.utf8"}) {
    std::setlocale(LC_NUMERIC, locale);
    const Mesh mesh = parse_obj_mesh(
        "v 500000.125 4600000.0625 0\nv 500001.5 4600000 +0.1\nv 5e5 4600001 0\nf 1 2 3\n", "m");
    CHECK(mesh.vertices[0] == Vector3d(500000.125, 4600000.0625, 0));
    CHECK(mesh.vertices[1].z() == 0.1);
  }
  std::setlocale(LC_NUMERIC, kept.c_str());
}

TEST_CASE("OBJ faces are read however they name texture and normals", "[mesh]") {
  for (const char* face : {"f 1 2 3 4", "f 1/ 2/ 3/ 4/", "f 1/1 2/2 3/3 4/4",
                           "f 1//1 2//1 3//1 4//1", "f 1/9/1 2/9/1 3/9/1 4/9/1", "f -4 -3 -2 -1",
                           "f 1 2 \\\n 3 4", "f  1\t2 3 4  # a square", "fo 1 2 3 4\r"}) {
    INFO(face);
    const Mesh mesh =
        parse_obj_mesh("# written\\\n" + square_obj + "vn 0 0 1\n" + face + "\n", "m");
    CHECK(mesh.triangles.size() == 2);
    CHECK(area(mesh) == 2);
  }
  CHECK(parse_obj_mesh("v 0 0 0 1\rv 2 0 0 1 0.5 0.5 0.5\rv 2 1 0 9 9 9\rf 1 2 3\r", "m")
            .triangles.size() == 1);
}

TEST_CASE("an OBJ that cannot be read whole is refused by line", "[mesh]") {
  const auto refused = [](const std::string& more) {
    return refusal(parse_obj_mesh, square_obj + more);
  };
  CHECK(refused("f 1 2 3\nl 1 2\np 3\ns off\nmtllib a b.mtl\n") == "read");
  CHECK_THAT(refused("f 1 2 5\n"), Contains("m:5: vertex 5 does not exist: 4 are defined so far"));
  CHECK_THAT(refused("f 1 2 -5\n"), Contains("m:5: vertex -5"));
  CHECK_THAT(refused("f 1 2 0\n"), Contains("m:5: found '0'"));
  CHECK_THAT(refused("f 1 2 99999999999999999999\n"), Contains("m:5: found '9999"));
  CHECK_THAT(refused("f 1 2 3/x\n"), Contains("m:5: found '3/x'"));
  CHECK_THAT(refused("f 1 2 3/1/1/1\n"), Contains("m:5"));
  CHECK_THAT(refused("f 1 2 3,4\n"), Contains("m:5"));
  CHECK_THAT(refused("f\n"), Contains("m:5: a face without corners"));
  CHECK_THAT(refused("v 1 2\n"), Contains("m:5: found 'v 1 2', expected 'v X Y Z'"));
  CHECK_THAT(refused("v 1,0 2,0 3,0\n"), Contains("m:5"));
  CHECK_THAT(refused("v 1 2 3 0.5\n"), Contains("m:5") && Contains("weight"));
  CHECK_THAT(refused("v 1 2 nan\n"), Contains("m:5: a coordinate is not finite"));
  CHECK_THAT(refused("curv2 1 2\n"), Contains("m:5: found 'curv2'"));
  CHECK_THAT(refused("call other.obj\n"), Contains("m:5: found 'call'"));
  CHECK_THAT(refused("f 1 2 3\n\\\nf 1 2 \\\n 7\n"), Contains("m:6: vertex 7"));
  CHECK_THAT(refused(""), Contains("holds no triangle"));
}

TEST_CASE("names of OBJ groups, objects and materials and of STL solids are kept", "[mesh]") {
  Mesh mesh = parse_obj_mesh(square_obj +
                                 "o sat\ng bus panel\nf 1 2 3\nusemtl foil\nf 1 3 4\ng\n"
                                 "usemtl\no\nf 1 2 4\ng none\n",
                             "m");
  REQUIRE(mesh.groups.size() == 4);
  const auto triangles = [&mesh](const std::string& name) {
    for (const MeshGroup& group : mesh.groups) {
      if (group.name == name) return group.triangles;
    }
    return std::vector<std::uint32_t>{};
  };
  CHECK(triangles("sat") == std::vector<std::uint32_t>{0, 1});
  CHECK(triangles("bus") == std::vector<std::uint32_t>{0, 1});
  CHECK(triangles("panel") == std::vector<std::uint32_t>{0, 1});
  CHECK(triangles("foil") == std::vector<std::uint32_t>{1});
  mesh.append(mesh);
  CHECK(mesh.groups.size() == 4);
  CHECK(triangles("foil") == std::vector<std::uint32_t>{1, 4});

  mesh = parse_stl_mesh("solid solar array\n" + facet + "endsolid solar array\nsolid\n" + facet +
                            "endsolid\nSOLID bus\n" + facet + "EndSolid bus\n\n",
                        "m");
  CHECK(mesh.triangles.size() == 3);
  REQUIRE(mesh.groups.size() == 2);
  CHECK(triangles("solar array") == std::vector<std::uint32_t>{0});
  CHECK(triangles("bus") == std::vector<std::uint32_t>{2});
}

TEST_CASE("binary STL is recognised by its size, whatever its header holds", "[mesh]") {
  for (const char* header : {"", "solid of a tool", "COLOR="}) {
    const std::string bytes = binary_stl(header, 3);
    CHECK(parse_stl_mesh(bytes, "m").triangles.size() == 3);
    for (std::size_t n = 0; n < bytes.size(); ++n)
      CHECK(refusal(parse_stl_mesh, bytes.substr(0, n)) != "read");
    CHECK_THAT(refusal(parse_stl_mesh, bytes.substr(0, 200)),
               Contains("3 facets declared, which take 234 bytes; found 200"));
    CHECK_THAT(refusal(parse_stl_mesh, bytes + "more"), Contains("found 238 bytes"));
  }
  std::string bytes = binary_stl("", 2);
  bytes.replace(84 + 50 + 12, 4, raw(std::nanf("")));
  CHECK_THAT(refusal(parse_stl_mesh, bytes),
             Contains("m: byte 134: facet 1: a coordinate is not finite"));
}

TEST_CASE("a text STL that is cut short or goes on otherwise is refused by line", "[mesh]") {
  const std::string good = "solid s\n" + facet + "endsolid s\n";
  CHECK(refusal(parse_stl_mesh, good) == "read");
  CHECK(refusal(parse_stl_mesh, replaced(good, "0 0 nan", "-nan(ind) 0 0")) == "read");
  CHECK_THAT(refusal(parse_stl_mesh, replaced(good, "endsolid s\n", "")),
             Contains("m:8: cut short"));
  CHECK_THAT(refusal(parse_stl_mesh, replaced(good, "endfacet\n", "")),
             Contains("m:8: found 'endsolid s', expected 'endfacet'"));
  CHECK_THAT(refusal(parse_stl_mesh, replaced(good, " endloop", "  vertex 1 1 0\n endloop")),
             Contains("m:7: found 'vertex 1 1 0', expected 'endloop'"));
  CHECK_THAT(refusal(parse_stl_mesh, replaced(good, "  vertex 1 0 0\n", "")),
             Contains("m:6: found 'endloop', expected 'vertex X Y Z'"));
  CHECK_THAT(refusal(parse_stl_mesh, replaced(good, "vertex 1 0 0", "vertex 1,5 0 0")),
             Contains("m:5"));
  CHECK_THAT(refusal(parse_stl_mesh, good + facet), Contains("m:10: found 'facet"));
  CHECK_THAT(refusal(parse_stl_mesh, "<html>"), Contains("m:1") && Contains("expected 'solid'"));
  CHECK_THAT(refusal(parse_stl_mesh, ""), Contains("holds no triangle"));
}

TEST_CASE("faces without area are left out and counted", "[mesh]") {
  const Mesh mesh = parse_obj_mesh(
      square_obj + "v 1 0 0\nf 1 2 3\nf 1 2 5\nf 1 1 3\nf 1 2\nf 1 5 2 1\nf 1 5 2 3\n", "m");
  CHECK(mesh.triangles.size() == 3);
  CHECK(mesh.faces_without_area == 4);
  CHECK_THAT(refusal(parse_obj_mesh, square_obj + "f 1 1 2\n"),
             Contains("holds no triangle: 1 faces without area"));
}

TEST_CASE("polygons are cut into triangles of their winding that fill them exactly", "[mesh]") {
  const auto check = [](const std::vector<Vector3d>& corners, double expected) {
    // in planes of any attitude, far away, and from any corner on
    const Eigen::AngleAxisd turns[] = {Eigen::AngleAxisd(0, Vector3d::UnitX()),
                                       Eigen::AngleAxisd(2.1, Vector3d(1, 2, 3).normalized()),
                                       Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX())};
    for (const auto& turn : turns) {
      for (std::size_t first = 0; first < corners.size(); ++first) {
        std::vector<Vector3d> placed;
        for (std::size_t i = 0; i < corners.size(); ++i) {
          placed.emplace_back(turn * corners[(first + i) % corners.size()] +
                              Vector3d(500, 4600, 7));
        }
        std::vector<std::array<std::uint32_t, 3>> triangles;
        REQUIRE(triangulate(placed, triangles));
        double sum = 0;
        for (const auto& t : triangles) {
          const Vector3d normal = (placed[t[1]] - placed[t[0]]).cross(placed[t[2]] - placed[t[0]]);
          CHECK((turn.inverse() * normal).z() > -1e-9);
          sum += normal.norm() / 2;
        }
        CHECK(sum == Approx(expected));
      }
    }
  };
  check({{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}, 2);
  check({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}, 2);  // a corner on an edge
  check({{0, 0, 0}, {4, 0, 0}, {1, 1, 0}, {0, 4, 0}}, 4);             // one concave corner
  check({{0, 0, 0}, {3, 0, 0}, {3, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}}, 5);  // L
  check({{0, 0, 0},
         {5, 0, 0},
         {5, 3, 0},
         {4, 3, 0},
         {4, 1, 0},
         {3, 1, 0},
         {3, 3, 0},
         {2, 3, 0},
         {2, 1, 0},
         {1, 1, 0},
         {1, 3, 0},
         {0, 3, 0}},
        11);  // a comb
  check({{0, 0, 0},
         {4, 0, 0},
         {4, 4, 0},
         {0, 4, 0},
         {0, 0, 0},
         {1, 1, 0},
         {1, 3, 0},
         {3, 3, 0},
         {3, 1, 0},
         {1, 1, 0}},
        12);  // a hole
  std::vector<Vector3d> star;
  for (int i = 0; i < 24; ++i) {
    const double angle = i * std::numbers::pi / 12;
    star.emplace_back((i % 2 == 0 ? 3 : 1) * Vector3d(std::cos(angle), std::sin(angle), 0));
  }
  check(star, 12 * 3 * 1 * std::sin(std::numbers::pi / 12));

  std::vector<std::array<std::uint32_t, 3>> triangles;
  CHECK_FALSE(
      triangulate(std::vector<Vector3d>{{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 1, 0}}, triangles));
  CHECK_FALSE(
      triangulate(std::vector<Vector3d>{{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2, 0}}, triangles));
  CHECK_THAT(refusal(parse_obj_mesh, square_obj + "f 1 3 2 4\n"),
             Contains("m:5: a face of 4 corners crosses itself"));
  // from the first corner on
  REQUIRE(
      triangulate(std::vector<Vector3d>{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}}, triangles));
  CHECK(triangles == std::vector<std::array<std::uint32_t, 3>>{{0, 1, 2}, {0, 2, 3}});
}
