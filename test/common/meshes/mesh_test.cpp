// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/mesh.h"

#include <fstream>

#include "common/core/error.h"
#include "common/core/ray_caster.h"
#include "common/meshes/mesh_file.h"
#include "common/targets/target.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/common/targets/radarsat2.h"

using namespace berth;

namespace {

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

const char* square_ply = R"(ply
format ascii 1.0
element vertex 4
property double x
property double y
property double z
element face 2
property list uchar int vertex_indices
end_header
0 0 0
2 0 0
2 1 0
0 1 0
3 0 1 2
3 0 2 3
)";

}  // namespace

TEST_CASE("building blocks have their size") {
  const Box box = bounding_box(make_box({1, 2, 3}));
  CHECK(box.low.isApprox(Vector3d(-0.5, -1, -1.5)));
  CHECK(box.high.isApprox(Vector3d(0.5, 1, 1.5)));
  CHECK(make_box({1, 2, 3}).triangles.size() == 12);

  CHECK(bounding_box(make_cylinder(0.5, 2, 24)).size().isApprox(Vector3d(1, 1, 2)));
  CHECK(make_cylinder(0.5, 2, 24, false).triangles.size() == 48);
  CHECK(make_cylinder(0.5, 2, 24, true).triangles.size() == 48 + 2 * 22);

  const Mesh strut = make_strut({0, 0, 0}, {0, 3, 0}, 0.1);
  CHECK(bounding_box(strut).low.y() == Approx(0).margin(1e-12));
  CHECK(bounding_box(strut).high.y() == Approx(3));
}

TEST_CASE("a mesh appended to itself is there twice") {
  Mesh mesh = make_box({1, 1, 1});
  mesh.append(mesh, {{5, 0, 0}, Quaterniond::Identity()});
  CHECK(mesh.triangles.size() == 24);
  CHECK(bounding_box(mesh).size().x() == Approx(6));
  CHECK(mesh.triangles[12][0] == 8 + mesh.triangles[0][0]);
}

TEST_CASE("scaling to a length is about the origin and by the longest side") {
  Mesh mesh;
  mesh.append(make_box({4, 1, 1}), {{3, 0, 0}, Quaterniond::Identity()});
  const Box box = bounding_box(scaled_to_length(mesh, 2));
  CHECK(box.size().isApprox(Vector3d(2, 0.5, 0.5)));
  CHECK(box.low.x() == Approx(0.5));
}

TEST_CASE("the content hash depends on content only") {
  const Mesh box = make_box({1, 1, 1});
  CHECK(content_hash(box) == content_hash(make_box({1, 1, 1})));
  CHECK(content_hash(box) != content_hash(make_box({1, 1, 1.0000001})));
  Mesh turned = box;
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  CHECK(content_hash(box) != content_hash(turned));
}

TEST_CASE("a mesh comes out of the PLY file that it was put in, to the bit") {
  TemporaryDirectory directory;
  const Mesh mesh = make_radarsat2();
  save_ply(mesh, directory / "replica.ply");
  const Mesh read = load_mesh(directory / "replica.ply");
  CHECK(read.triangles.size() == mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(read.vertices[read.triangles[i][k]] == mesh.vertices[mesh.triangles[i][k]]);
    }
  }
  CHECK_THROWS_AS(save_ply(mesh, directory / "no" / "such" / "place.ply"), InputError);
}

TEST_CASE("PLY, STL and OBJ of one shape load alike") {
  TemporaryDirectory directory;
  write(directory / "a.ply", square_ply);
  write(directory / "b.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3 4\n");
  write(directory / "c.STL",
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 2 1 0\n"
        "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 2 1 0\n"
        "vertex 0 1 0\nendloop\nendfacet\nendsolid s\n");
  for (const char* name : {"a.ply", "b.obj", "c.STL"}) {
    INFO(name);
    const Mesh mesh = load_mesh(directory / name);
    CHECK(mesh.vertices.size() == 4);
    CHECK(mesh.triangles.size() == 2);
    CHECK(bounding_box(mesh).size().isApprox(Vector3d(2, 1, 0)));
  }
}

TEST_CASE("a file that is no mesh is refused by name") {
  TemporaryDirectory directory;
  using Catch::Matchers::Contains;
  const auto path = [&](const char* name) { return (directory / name).string(); };

  CHECK_THROWS_WITH(load_mesh(path("gone.ply")), Contains("gone.ply") && Contains("no such file"));
  write(directory / "image.png", "x");
  CHECK_THROWS_WITH(load_mesh(path("image.png")), Contains("expected a .ply, .stl or .obj"));
  write(directory / "empty.ply", "");
  CHECK_THROWS_AS(load_mesh(path("empty.ply")), InputError);
  write(directory / "noise.ply", std::string("ply\nformat nonsense\n\0\1\2", 20));
  CHECK_THROWS_AS(load_mesh(path("noise.ply")), InputError);

  std::string bad = square_ply;
  bad.replace(bad.find("2 1 0\n"), 6, "nan 1 0\n");
  write(directory / "nan.ply", bad);
  CHECK_THROWS_WITH(load_mesh(path("nan.ply")), Contains("not finite"));

  // Both triangles without area: nothing is left.
  write(directory / "flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3\nf 2 3 4\n");
  CHECK_THROWS_WITH(load_mesh(path("flat.obj")), Contains("no triangle"));
}

TEST_CASE("degenerate triangles are dropped, the others stay") {
  TemporaryDirectory directory;
  write(directory / "mixed.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\nf 1 1 4\n");
  CHECK(load_mesh(directory / "mixed.obj").triangles.size() == 1);
}

TEST_CASE("a target is a folder or a mesh file, scaled when asked") {
  TemporaryDirectory directory;
  const Target replica = load_target("radarsat2", 0);
  CHECK(replica.length == Approx(3.0));
  REQUIRE(replica.port() != nullptr);
  CHECK((replica.port()->pose.rotation * Vector3d::UnitZ()).isApprox(-Vector3d::UnitZ()));

  const Target half = load_target("radarsat2", 1.5);
  CHECK(half.length == Approx(1.5));
  CHECK(half.port()->pose.position.isApprox(0.5 * replica.port()->pose.position));
  CHECK(half.hash != replica.hash);

  write(directory / "plate.ply", square_ply);
  const Target plate = load_target((directory / "plate.ply").string(), 3);
  CHECK(plate.name == "plate");
  CHECK(plate.length == Approx(3));
  CHECK(plate.port() == nullptr);
  CHECK(bounding_box(plate.mesh).low.isApprox(Vector3d::Zero()));  // its own origin

  CHECK_THROWS_AS(load_target("radarsat2", -1), InputError);
  CHECK_THROWS_WITH(load_target("radarsat3", 0),
                    Catch::Matchers::Contains("a name of targets/ (radarsat2"));
}

TEST_CASE("a mesh far from its origin is taken about its centre, exactly, and that is reported") {
  TemporaryDirectory directory;
  const Mesh replica = make_radarsat2();
  Mesh far = replica;
  const Vector3d map(500000, 4600000, 120);
  for (Vector3d& v : far.vertices) v += map;
  save_ply(far, directory / "utm.ply");
  const Target target = load_target((directory / "utm.ply").string(), 0);
  CHECK(target.mesh.triangles.size() == replica.triangles.size());
  const Vector3d centre = bounding_box(replica).centre();
  CHECK(target.file_origin.isApprox(map + centre, 1e-12));
  CHECK(target.length == Approx(3).margin(1e-8));
  REQUIRE(target_notes(target).size() == 1);
  CHECK_THAT(target_notes(target)[0], Catch::Matchers::Contains("its origin is 4627094 m away"));

  // the same is seen of it
  const RayCaster near_caster(replica);
  const RayCaster far_caster(target.mesh);
  for (int i = -20; i <= 20; ++i) {
    const Vector3d direction =
        Vector3d(0.013 * i + 0.0011, 0.0041 * (i % 7) + 0.0007, 1).normalized();
    RayHit hit;
    RayHit far_hit;
    const bool met = near_caster.cast({{0, 0, -6}, direction}, 100, hit);
    REQUIRE(far_caster.cast({Vector3d(0, 0, -6) - centre, direction}, 100, far_hit) == met);
    if (!met) continue;
    CHECK(far_hit.range == Approx(hit.range).margin(1e-6));
    CHECK(far_hit.normal.isApprox(hit.normal, 1e-6));
  }
}

TEST_CASE("possible mistakes in a target are reported") {
  using Catch::Matchers::Contains;
  const auto notes = [](Mesh mesh) {
    Target target;
    target.mesh = std::move(mesh);
    target.length = bounding_box(target.mesh).size().maxCoeff();
    std::string all;
    for (const std::string& note : target_notes(target)) all += note + "\n";
    return all;
  };
  const auto placed = [](const Mesh& mesh, const Vector3d& at) {
    Mesh moved;
    moved.append(mesh, {at, Quaterniond(Eigen::AngleAxisd(1, Vector3d(1, 2, 3).normalized()))});
    return moved;
  };
  const auto turned = [](Mesh mesh) {
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
    return mesh;
  };
  CHECK(target_notes(load_target("radarsat2", 0)).empty());
  const Mesh box = make_box({2, 1, 1});
  CHECK(notes(box).empty());
  CHECK(notes(placed(box, {3, 0, 0})).empty());
  CHECK_THAT(notes(placed(box, {9, 0, 0})),
             Contains("its origin is 7.848 m") && Contains("outside of it"));
  CHECK_THAT(notes(scaled_to_length(box, 2000)), Contains("2000 m long") && Contains("in mm"));
  CHECK_THAT(notes(scaled_to_length(box, 0.002)), Contains("0.002 m long"));
  CHECK_THAT(notes(turned(box)), Contains("12 of 12 triangles look inward"));

  Mesh open = turned(box);  // which side is outside of a surface that is not closed?
  open.triangles.pop_back();
  CHECK(notes(open).empty());
  Mesh hollow = box;
  hollow.append(turned(make_box({1, 0.5, 0.5})));
  CHECK(notes(hollow).empty());

  Mesh sheet = make_box({2, 1, 1});
  sheet.triangles.resize(2);
  sheet.vertices.resize(4);
  CHECK_THAT(notes(placed(sheet, {0, 0, 0})), Contains("in one plane"));
  Mesh partly = box;
  partly.faces_without_area = 3;
  CHECK_THAT(notes(partly), Contains("3 faces without area were left out, 12 triangles were kept"));
}
