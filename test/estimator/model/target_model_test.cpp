// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/target_model.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "estimator/model/model_file.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

Target target_of(const Mesh& mesh) {
  Target target;
  target.name = "test";
  target.mesh = mesh;
  target.hash = content_hash(mesh);
  target.length = bounding_box(mesh).size().maxCoeff();
  return target;
}

ModelOptions coarse() {
  ModelOptions options;
  options.surface_samples = 4000;
  options.grid_voxels = 30000;
  options.template_rotations = 12;
  return options;
}

/// A directory of its own that goes away.
struct Scratch {
  std::filesystem::path path;
  Scratch()
      : path(std::filesystem::temp_directory_path() /
             ("berth-model-test-" + std::to_string(getpid()))) {
    std::filesystem::remove_all(path);
  }
  ~Scratch() { std::filesystem::remove_all(path); }
};

std::filesystem::path only_file_in(const std::filesystem::path& directory) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    files.push_back(entry.path());
  }
  REQUIRE(files.size() == 1);
  return files.front();
}

}  // namespace

TEST_CASE("What is inside a closed hull is no visible surface, whatever the winding") {
  Mesh mesh = make_box({2, 1, 1});
  mesh.append(make_box({1, 0.5, 0.5}));  // within
  const std::size_t outer = 12;
  for (std::size_t i = 0; i < mesh.triangles.size(); i += 2) {
    std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
  }
  const RayCaster caster(mesh);
  const VisibleSurface surface = find_visible_surface(mesh, caster, 3000);
  REQUIRE(surface.samples.size() > 2000);
  CHECK(surface.triangles.size() == outer);
  CHECK(surface.triangles.back() == outer - 1);
  for (const SurfaceSample& s : surface.samples) {
    REQUIRE(s.triangle < outer);
    // the normal looks out, whatever the winding
    REQUIRE(s.normal.dot(s.position) > 0);
    // half of the sphere sees a face
    REQUIRE(s.visible_from.size() > 50);
    REQUIRE(s.visible_from.size() < 78);
  }
}

TEST_CASE("Surface samples are spread by area") {
  const Mesh mesh = make_box({2, 1, 0.5});
  const VisibleSurface surface = find_visible_surface(mesh, RayCaster(mesh), 7000);
  int large = 0;
  for (const SurfaceSample& s : surface.samples) large += std::abs(s.normal.z()) > 0.9F ? 1 : 0;
  // 2 x 1 twice of 7 m2
  CHECK(large / static_cast<double>(surface.samples.size()) == Approx(4.0 / 7.0).margin(0.02));
}

TEST_CASE("The canonical pose puts the major axis on x and the centroid at the origin") {
  Mesh mesh;
  const Pose placed = pose_from_xyzwpr({300, -200, 100, 20, 30, 40});
  mesh.append(make_box({3, 0.2, 0.6}), placed);
  const VisibleSurface surface = find_visible_surface(mesh, RayCaster(mesh), 6000);
  const CanonicalPose canonical = find_canonical_pose(surface.samples);
  const Pose box_in_canonical = canonical.pose * placed;
  CHECK(box_in_canonical.position.norm() < 0.01);
  const Matrix3d r = box_in_canonical.rotation.toRotationMatrix();
  CHECK(std::abs(r(0, 0)) > 0.999);  // the long side
  CHECK(std::abs(r(1, 1)) > 0.999);  // the thin side: minor axis on y
  CHECK(canonical.half_length == Approx(1.5).margin(0.02));
  CHECK(canonical.elongation() > 3);
}

TEST_CASE("Closest points of the grid are those of the mesh") {
  const auto model = replica_model();
  Random random(1, "grid");
  const Box box = bounding_box(model->target.mesh);
  int off = 0;
  double worst = 0;
  constexpr int count = 3000;
  for (int i = 0; i < count; ++i) {
    // near the surface, where tracking queries
    const auto& samples = model->surface.samples;
    const Vector3d q = samples[random.bits() % samples.size()].position.cast<double>() +
                       random.normal_vector(0.02);
    ClosestPointGrid::Match match;
    REQUIRE(model->grid.refined(q, match));
    const double excess = (match.point - q).norm() - (model->caster.nearest(q) - q).norm();
    worst = std::max(worst, excess);
    off += excess > 0.002 ? 1 : 0;
    REQUIRE(match.normal.norm() == Approx(1));
    REQUIRE(model->grid.stored(q, match));
    REQUIRE((match.point - q).norm() - (model->caster.nearest(q) - q).norm() <
            2 * model->grid.cell());
  }
  CHECK(off < 0.1 * count);
  CHECK(worst < model->grid.cell());
  ClosestPointGrid::Match match;
  CHECK_FALSE(model->grid.refined(box.high + Vector3d::Constant(1), match));
}

TEST_CASE("Templates find the turn and shift of a cloud") {
  const auto model = replica_model();
  const VoxelTemplates& templates = model->templates;
  const int turn = 17;
  const Vector3d shift = templates.cell() * Vector3d(3, -2, 1);
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < model->surface.samples.size(); i += 5) {
    const Vector3d p = model->canonical.pose * model->surface.samples[i].position.cast<double>();
    points.push_back(rotation_from_vector({templates.angle(turn), 0, 0}) * p + shift);
  }
  const std::vector<Correlation> found = templates.correlate(points, 6, 4);
  const auto best = std::max_element(
      found.begin(), found.end(), [](const auto& a, const auto& b) { return a.score < b.score; });
  CHECK(best->rotation == turn);
  CHECK(best->shift == std::array<int, 3>{3, -2, 1});
}

TEST_CASE("A box has its eight corners and twelve edges as scan regions") {
  const Mesh mesh = make_box({1.5, 1, 0.8});
  const VisibleSurface surface = find_visible_surface(mesh, RayCaster(mesh), 12000);
  const auto regions = find_scan_regions(surface.samples, 0.1);
  std::set<int> corners;
  int edges = 0;
  for (const ScanRegion& r : regions) {
    const Vector3d away = (Vector3d(0.75, 0.5, 0.4) - r.position.cast<double>().cwiseAbs());
    const int near_faces = static_cast<int>((away.array() < 0.06).count());
    if (r.kind == ScanRegion::Kind::corner) {
      REQUIRE(near_faces == 3);
      corners.insert((r.position.x() > 0 ? 1 : 0) + (r.position.y() > 0 ? 2 : 0) +
                     (r.position.z() > 0 ? 4 : 0));
    } else if (r.kind == ScanRegion::Kind::edge) {
      REQUIRE(near_faces >= 2);
      ++edges;
    }
    REQUIRE(r.visible_from.size() > 0);
  }
  CHECK(corners.size() == 8);
  CHECK(edges >= 12);
}

TEST_CASE("The replica has regions of every kind, at the ends of the antenna too") {
  const auto model = replica_model();
  int kinds[3] = {0, 0, 0};
  int ends = 0;
  for (const ScanRegion& r : model->regions) {
    ++kinds[static_cast<int>(r.kind)];
    ends += r.kind == ScanRegion::Kind::corner && std::abs(r.position.x()) > 1.4F ? 1 : 0;
  }
  CHECK(kinds[0] >= 10);
  CHECK(kinds[1] >= 20);
  CHECK(kinds[2] >= 15);
  CHECK(ends == 4);
}

TEST_CASE("A model comes out of the cache as it went in") {
  const Scratch cache;
  const Target target = target_of(make_box({2, 0.6, 0.4}));
  bool loaded = true;
  const auto compiled = load_target_model(target, coarse(), cache.path, &loaded);
  CHECK_FALSE(loaded);
  const auto again = load_target_model(target, coarse(), cache.path, &loaded);
  CHECK(loaded);
  CHECK(again->surface.samples.size() == compiled->surface.samples.size());
  CHECK(again->regions.size() == compiled->regions.size());
  CHECK(again->canonical.pose.rotation.coeffs() == compiled->canonical.pose.rotation.coeffs());
  Random random(1, "cache");
  for (int i = 0; i < 200; ++i) {
    const Vector3d q = {random.uniform(-1, 1), random.uniform(-0.3, 0.3),
                        random.uniform(-0.2, 0.2)};
    ClosestPointGrid::Match a;
    ClosestPointGrid::Match b;
    REQUIRE(again->grid.refined(q, a));
    REQUIRE(compiled->grid.refined(q, b));
    REQUIRE(a.point == b.point);
    REQUIRE(a.normal == b.normal);
  }
  std::vector<Vector3d> points;
  for (const SurfaceSample& s : compiled->surface.samples) {
    points.push_back(compiled->canonical.pose * s.position.cast<double>());
  }
  CHECK(again->templates.correlate(points, 2, 2)[3].score ==
        compiled->templates.correlate(points, 2, 2)[3].score);

  REQUIRE(again->views.size() == compiled->views.size());
  REQUIRE_FALSE(compiled->views.empty());
  for (std::size_t i = 0; i < compiled->views.size(); ++i) {
    const ViewTemplate& a = again->views[i];
    const ViewTemplate& b = compiled->views[i];
    CHECK(a.view.coeffs() == b.view.coeffs());
    CHECK((a.points == b.points).all());
    REQUIRE(a.outside.rows() == b.outside.rows());
    CHECK((a.outside == b.outside).all());
    CHECK(a.area == b.area);
    CHECK(a.perimeter == b.perimeter);
  }

  // other content, other options: other files
  load_target_model(target_of(make_box({2, 0.6, 0.41})), coarse(), cache.path, &loaded);
  CHECK_FALSE(loaded);
  ModelOptions finer = coarse();
  finer.grid_voxels = 31000;
  load_target_model(target, finer, cache.path, &loaded);
  CHECK_FALSE(loaded);
}

TEST_CASE("A damaged cache file is compiled anew and replaced") {
  const Scratch cache;
  const Target target = target_of(make_box({2, 0.6, 0.4}));
  bool loaded = false;
  load_target_model(target, coarse(), cache.path, &loaded);
  const auto path = only_file_in(cache.path);
  const auto size = std::filesystem::file_size(path);

  SECTION("a flipped byte") {
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(static_cast<std::streamoff>(size / 2));
    const char byte = static_cast<char>(file.get());
    file.seekp(static_cast<std::streamoff>(size / 2));
    file.put(static_cast<char>(byte ^ 1));
  }
  SECTION("cut short") { std::filesystem::resize_file(path, size - 100); }
  SECTION("empty") { std::filesystem::resize_file(path, 0); }

  load_target_model(target, coarse(), cache.path, &loaded);
  CHECK_FALSE(loaded);
  CHECK(only_file_in(cache.path) == path);
  load_target_model(target, coarse(), cache.path, &loaded);
  CHECK(loaded);
}

TEST_CASE("A cache that cannot be written is no error") {
  const Target target = target_of(make_box({2, 0.6, 0.4}));
  CHECK(load_target_model(target, coarse(), "/proc/no-such-place") != nullptr);
}
