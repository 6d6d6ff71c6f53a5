// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/ray_caster.h"

#include <cmath>
#include <limits>

#include "common/core/random.h"
#include "common/targets/target.h"
#include "test/catch.h"
#include "test/common/targets/radarsat2.h"

using namespace berth;

TEST_CASE("rays hit both sides of a surface, with the normal against them") {
  const RayCaster caster(make_box({2, 2, 2}));
  RayHit hit;
  REQUIRE(caster.cast({{0.3, 0.2, -5}, Vector3d::UnitZ()}, 100, hit));
  CHECK(hit.range == Approx(4).epsilon(1e-12));
  CHECK(hit.normal.isApprox(-Vector3d::UnitZ()));
  REQUIRE(caster.cast({{0.3, 0.2, 0}, Vector3d::UnitZ()}, 100, hit));  // from inside
  CHECK(hit.range == Approx(1).epsilon(1e-12));
  CHECK(hit.normal.isApprox(-Vector3d::UnitZ()));
}

TEST_CASE("surfaces behind the sensor, next to the ray or out of reach are not hit") {
  const RayCaster caster(make_box({2, 2, 2}));
  RayHit hit;
  CHECK_FALSE(caster.cast({{0, 0, 5}, Vector3d::UnitZ()}, 100, hit));
  CHECK_FALSE(caster.cast({{1.001, 0, -5}, Vector3d::UnitZ()}, 100, hit));
  CHECK_FALSE(caster.cast({{0, 0, -5}, Vector3d::UnitZ()}, 3.999, hit));
  CHECK_FALSE(caster.occluded({{0, 0, -5}, Vector3d::UnitZ()}, 3.999));
  CHECK(caster.occluded({{0, 0, -5}, Vector3d::UnitZ()}, 4.001));
}

TEST_CASE("distance costs no precision") {
  const RayCaster caster(make_box({2, 2, 2}));
  RayHit hit;
  const Vector3d direction = Vector3d(0.0003, 0.0004, 1).normalized();
  REQUIRE(caster.cast({{0, 0, -800}, direction}, 1000, hit));
  CHECK(hit.range == Approx(799 / direction.z()).epsilon(1e-13));
}

TEST_CASE("an empty mesh is not hit") {
  const RayCaster caster{Mesh{}};
  RayHit hit;
  CHECK_FALSE(caster.cast({}, 100, hit));
  CHECK_FALSE(caster.occluded({}, 100));
  CHECK_THROWS(caster.nearest({0, 0, 0}));
}

TEST_CASE("the caster agrees with every triangle tried by hand") {
  const Mesh mesh = make_radarsat2();
  const RayCaster caster(mesh);
  Random random(3, "rays");
  int hits = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d origin = random.rotation() * Vector3d(0, 0, -5);
    const Vector3d aim(random.uniform(-1.5, 1.5), random.uniform(-0.5, 0.6),
                       random.uniform(-0.2, 0.2));
    const Ray ray{origin, (aim - origin).normalized()};
    double expected = std::numeric_limits<double>::infinity();
    double edge = 1;  // how close to an edge of any triangle: there, float and double may differ
    for (const auto& t : mesh.triangles) {
      const Vector3d& a = mesh.vertices[t[0]];
      Matrix3d system;
      system << mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a, -ray.direction;
      if (std::abs(system.determinant()) < 1e-12) continue;
      const Vector3d uvt = system.inverse() * (ray.origin - a);
      const double inside = std::min({uvt[0], uvt[1], 1 - uvt[0] - uvt[1]});
      if (uvt[2] > 0) edge = std::min(edge, std::abs(inside));
      if (inside >= 0 && uvt[2] > 0) expected = std::min(expected, uvt[2]);
    }
    RayHit hit;
    const bool found = caster.cast(ray, 100, hit);
    if (edge < 1e-3) continue;
    REQUIRE(found == std::isfinite(expected));
    CHECK(found == caster.occluded(ray, 100));
    if (found) {
      ++hits;
      CHECK(hit.range == Approx(expected).epsilon(1e-6));
    }
  }
  CHECK(hits > 200);
}

TEST_CASE("the nearest point is the nearest of all triangles") {
  const Mesh mesh = make_radarsat2();
  const RayCaster caster(mesh);
  std::vector<RayCaster> alone;
  for (const auto& t : mesh.triangles) {
    Mesh one;
    for (const auto index : t) one.vertices.push_back(mesh.vertices[index]);
    one.triangles = {{0, 1, 2}};
    alone.emplace_back(one);
  }
  Random random(5, "points");
  for (int i = 0; i < 100; ++i) {
    const Vector3d p = Vector3d(0, 0, 0) + random.normal_vector(1.0);
    double expected = std::numeric_limits<double>::infinity();
    for (const auto& one : alone) expected = std::min(expected, (one.nearest(p) - p).norm());
    std::uint32_t triangle = 0;
    const Vector3d q = caster.nearest(p, &triangle);
    CHECK((q - p).norm() == Approx(expected).epsilon(1e-12));
    CHECK((alone[triangle].nearest(p) - q).norm() < 1e-12);
  }
  // And by geometry: above a face, off an edge, off a corner of a box.
  const RayCaster box(make_box({2, 2, 2}));
  CHECK(box.nearest({0.2, 0.3, 3}).isApprox(Vector3d(0.2, 0.3, 1)));
  CHECK(box.nearest({3, 0.3, 3}).isApprox(Vector3d(1, 0.3, 1)));
  CHECK(box.nearest({3, -4, 3}).isApprox(Vector3d(1, -1, 1)));
}

TEST_CASE("building a caster leaves floating point as it was") {
  const RayCaster caster(make_radarsat2());
  volatile double denormal = std::numeric_limits<double>::min();
  denormal = denormal / 4;
  CHECK(denormal > 0);
}

TEST_CASE("rays in packets meet what single rays meet") {
  const Target target = load_target("radarsat2", 0);
  const RayCaster caster(target.mesh);
  Random random(3, "packets");
  std::vector<Ray> rays;
  for (int i = 0; i < 1003; ++i) {  // not a multiple of a packet's width
    rays.push_back({{0, 0, -5}, (Vector3d(0, 0, 5) + random.normal_vector(0.5)).normalized()});
  }
  rays[7].direction = -rays[7].direction;  // away from the target
  std::vector<RayHit> hits(rays.size());
  caster.cast(rays, 20, hits);
  int met = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    RayHit single;
    const bool found = caster.cast(rays[i], 20, single);
    REQUIRE(found == std::isfinite(hits[i].range));
    if (!found) continue;
    ++met;
    CHECK(hits[i].range == Approx(single.range).epsilon(1e-9));
    CHECK(hits[i].normal.isApprox(single.normal, 1e-9));
  }
  CHECK(met > 100);
  CHECK(met < 1000);

  caster.cast(rays, 3, hits);
  for (const RayHit& hit : hits) CHECK_FALSE(std::isfinite(hit.range));  // all out of reach
  RayCaster(Mesh{}).cast(rays, 20, hits);
  for (const RayHit& hit : hits) CHECK_FALSE(std::isfinite(hit.range));
}

TEST_CASE("what a ray met is where it meets the triangle's plane") {
  const Target target = load_target("radarsat2", 0);
  const RayCaster caster(target.mesh);
  Random random(4, "planes");
  int met = 0;
  for (int i = 0; i < 300; ++i) {
    const Ray ray{{0, 0, -5}, (Vector3d(0, 0, 5) + random.normal_vector(0.5)).normalized()};
    RayHit cast;
    if (!caster.cast(ray, 20, cast) || cast.normal.dot(ray.direction) > -0.05) continue;
    ++met;
    RayHit again;
    caster.meet(ray, cast.triangle, again);
    CHECK(again.triangle == cast.triangle);
    CHECK(again.range == Approx(cast.range).epsilon(1e-9));
    CHECK(again.normal.isApprox(cast.normal, 1e-9));
    caster.meet({ray.origin, -ray.direction}, cast.triangle, again);
    CHECK(again.range == Approx(-cast.range).epsilon(1e-9));
    CHECK(again.normal.isApprox(-cast.normal, 1e-9));
  }
  CHECK(met > 50);

  const RayCaster plate(make_box({1, 1, 0}));
  RayHit hit;
  plate.meet({{0, 0, -1}, Vector3d::UnitX()}, 0, hit);
  CHECK_FALSE(std::isfinite(hit.range));
}
