// SPDX-License-Identifier: BSD-3-Clause
#include "test/common/targets/radarsat2.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

#include "common/core/random.h"
#include "common/core/ray_caster.h"
#include "common/targets/target.h"
#include "test/catch.h"

using namespace berth;

namespace {

/// Points spread evenly over all triangles.
std::vector<Vector3d> surface_points(const Mesh& mesh, int count) {
  std::vector<double> areas;
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    area += (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
    areas.push_back(area);
  }
  Random random(7, "surface");
  std::vector<Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const auto at = std::lower_bound(areas.begin(), areas.end(), random.uniform() * area);
    const auto& t = mesh.triangles[static_cast<std::size_t>(at - areas.begin())];
    double u = random.uniform();
    double v = random.uniform();
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Vector3d& a = mesh.vertices[t[0]];
    points.emplace_back(a + u * (mesh.vertices[t[1]] - a) + v * (mesh.vertices[t[2]] - a));
  }
  return points;
}

/// Share of the surface that lies more than 2 cm off the mesh after the rotation.
double mismatch(const Mesh& mesh, const Quaterniond& rotation) {
  const RayCaster caster(mesh);
  int off = 0;
  const auto points = surface_points(mesh, 2000);
  for (const auto& p : points) {
    if ((caster.nearest(rotation * p) - rotation * p).norm() > 0.02) ++off;
  }
  return off / static_cast<double>(points.size());
}

const Quaterniond about_z(0, 0, 0, 1);
const Quaterniond about_y(0, 0, 1, 0);

}  // namespace

TEST_CASE("the replica has the size and the axes of the paper") {
  const Mesh mesh = make_radarsat2();
  const Box box = bounding_box(mesh);
  CHECK(box.size().x() == Approx(3.0));
  CHECK(box.size().y() < 1.0);
  CHECK(box.size().z() < 0.5);
  CHECK(mesh.triangles.size() >= 276);
  CHECK(mesh.triangles.size() <= 1000);

  const auto points = surface_points(mesh, 5000);
  Vector3d mean = Vector3d::Zero();
  for (const auto& p : points) mean += p / 5000;
  CHECK(mean.norm() < 0.05);  // origin at the centroid
  Matrix3d scatter = Matrix3d::Zero();
  for (const auto& p : points) scatter += p * p.transpose() / 5000;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(scatter);
  const Vector3d sigma = axes.eigenvalues().cwiseSqrt();
  CHECK(sigma[2] / sigma[1] > 1.7);                         // elongated
  CHECK(std::abs(axes.eigenvectors().col(2).x()) > 0.999);  // along x
  CHECK(std::abs(axes.eigenvectors().col(1).y()) > 0.99);   // then y
}

TEST_CASE("the docking interface is the first thing a chaser meets") {
  const Radarsat2 replica = build_radarsat2(SymmetryBreaker::paper);
  const RayCaster caster(replica.mesh);
  RayHit hit;
  // Down the ring: the bus, 30 mm behind the rim.
  const Vector3d& centre = replica.docking.position;
  REQUIRE(caster.cast({centre - Vector3d(0, 0, 2), Vector3d::UnitZ()}, 10, hit));
  CHECK(hit.range == Approx(2.03).epsilon(1e-6));
  // On the rim, between the lugs.
  REQUIRE(caster.cast({centre + Vector3d(0, -0.1125, -2), Vector3d::UnitZ()}, 10, hit));
  CHECK(hit.range == Approx(2.0).epsilon(1e-6));
}

TEST_CASE("the symmetry breaker distinguishes top from bottom, the ring front from back") {
  CHECK(mismatch(make_radarsat2(SymmetryBreaker::none), about_z) < 0.001);
  const double paper = mismatch(make_radarsat2(SymmetryBreaker::paper), about_z);
  const double strong = mismatch(make_radarsat2(SymmetryBreaker::strong), about_z);
  CHECK(paper > 0.05);
  CHECK(strong > paper);
  // Front and back differ little: ring, arrays' setback, truss.
  CHECK(mismatch(make_radarsat2(SymmetryBreaker::none), about_y) > 0.02);
}

TEST_CASE("the shipped replica is the one that is built, to the bit") {
  const Target shipped = load_target("radarsat2", 0);
  const Radarsat2 built = build_radarsat2(SymmetryBreaker::paper);
  CHECK(shipped.hash == content_hash(built.mesh));
  CHECK(shipped.port("ring")->pose.position.isApprox(built.docking.position, 1e-12));
  CHECK(std::abs(shipped.port("ring")->pose.rotation.dot(built.docking.rotation)) > 1 - 1e-12);
}
