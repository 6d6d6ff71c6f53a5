// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/true_target.h"

#include <cmath>
#include <map>

#include "common/core/ray_caster.h"
#include "drivers/simulated/world.h"
#include "test/catch.h"

using namespace berth;

namespace {

/// A body with a panel on a hinge next to it, and a mast of its own; the body is soft.
Target satellite() {
  Target target;
  target.name = "satellite";
  target.mesh = make_box({1, 1, 1});
  const std::size_t body = target.mesh.triangles.size();
  target.mesh.append(make_box({1.5, 0.6, 0.05}), {{1.25, 0, 0}, Quaterniond::Identity()});
  const std::size_t panel = target.mesh.triangles.size();
  target.mesh.append(make_box({0.1, 0.1, 1}), {{0, 0, 1}, Quaterniond::Identity()});
  target.part_of.assign(target.mesh.triangles.size(), 0);
  std::fill_n(target.part_of.begin(), body, std::uint16_t{1});
  std::fill(target.part_of.begin() + static_cast<std::ptrdiff_t>(body),
            target.part_of.begin() + static_cast<std::ptrdiff_t>(panel), std::uint16_t{2});
  target.parts = {{}, {}, {}};
  target.parts[0].name = "default";
  target.parts[1].name = "body";
  target.parts[1].surface_sigma = 0.008;
  target.parts[1].correlation_length = 0.1;
  target.parts[1].scan = ScanPreference::avoid;
  target.parts[2].name = "panel";
  target.parts[2].correlation_length = 0.1;
  target.parts[2].joint =
      Joint{Vector3d::UnitX(), Vector3d::Zero(), radians(-20), radians(20), radians(18)};
  target.length = bounding_box(target.mesh).size().maxCoeff();
  return target;
}

double area_of(const Mesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3d& a = mesh.vertices[t[0]];
    area += 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
  }
  return area;
}

/// Edges that a mesh ends at: of one triangle alone, by the places of their ends.
std::size_t open_edges(const Mesh& mesh) {
  using Place = std::array<double, 3>;
  std::map<std::pair<Place, Place>, int> edges;
  const auto place = [&](std::uint32_t v) {
    const Vector3d& p = mesh.vertices[v];
    return Place{p.x(), p.y(), p.z()};
  };
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      ++edges[std::minmax(place(t[i]), place(t[(i + 1) % 3]))];
    }
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : edges) open += count == 1 ? 1 : 0;
  return open;
}

}  // namespace

TEST_CASE("without departures the true target is the described one, to the bit") {
  const Target target = satellite();
  const TrueTarget truth = draw_true_target(target, {}, 7);
  CHECK(truth.target.mesh.vertices == target.mesh.vertices);
  CHECK(truth.target.mesh.triangles == target.mesh.triangles);
  CHECK(truth.target.part_of == target.part_of);
  CHECK(truth.missing.empty());
}

TEST_CASE("the true surface departs from the mesh by each part's sigma, and does not tear") {
  const Target target = satellite();
  TargetDepartures departures;
  departures.surface = 1;
  double body = 0;
  double panel = 0;
  constexpr int seeds = 8;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    const TrueTarget truth = draw_true_target(target, departures, seed);
    body += std::pow(truth.parts[1].rms, 2) / seeds;
    panel += std::pow(truth.parts[2].rms, 2) / seeds;
    CHECK(open_edges(truth.target.mesh) == 0);
    CHECK(truth.target.part_of.size() == truth.target.mesh.triangles.size());
  }
  CHECK(std::sqrt(body) == Approx(0.008).epsilon(0.15));
  CHECK(std::sqrt(panel) == Approx(0.0005).epsilon(0.15));

  const Mesh one = draw_true_target(target, departures, 1).target.mesh;
  CHECK(draw_true_target(target, departures, 1).target.mesh.vertices == one.vertices);
  CHECK(draw_true_target(target, departures, 2).target.mesh.vertices != one.vertices);
  // Rims move, too: the middle of the body's upper edge, across both of its faces.
  const RayCaster before(target.mesh);
  const RayCaster after(one);
  CHECK((after.nearest({0.5, 0.5, 0.1}) - Vector3d(0.5, 0.5, 0.1)).norm() > 1e-4);
  // Faces tilt by about sigma over the correlation length.
  double slope = 0;
  int faces = 0;
  for (double x = -0.4; x < 0.41; x += 0.1) {
    for (double y = -0.4; y < 0.41; y += 0.1) {
      RayHit hit;
      REQUIRE(after.cast({{x, y, -5}, Vector3d::UnitZ()}, 10, hit));
      slope += std::pow(std::acos(-hit.normal.z()), 2);
      ++faces;
    }
  }
  CHECK(std::sqrt(slope / faces / 2) == Approx(0.008 / 0.1).epsilon(0.4));

  departures.soft_surface = 0.002;
  departures.rigid_surface = 0;
  const TrueTarget other = draw_true_target(target, departures, 1);
  CHECK(other.parts[1].rms == Approx(0.002).epsilon(0.4));
  CHECK(other.parts[2].rms < 1e-4);  // where it touches the body
}

TEST_CASE("neighbouring places of a surface depart alike, by the correlation length") {
  Target plate;
  plate.mesh = make_box({4, 4, 0.01});
  plate.parts[0].surface_sigma = 0.01;
  plate.parts[0].correlation_length = 0.2;
  plate.length = 4;
  TargetDepartures departures;
  departures.surface = 1;
  const RayCaster truth(draw_true_target(plate, departures, 3).target.mesh);
  const auto height = [&](double x, double y) {
    RayHit hit;
    REQUIRE(truth.cast({{x, y, -1}, Vector3d::UnitZ()}, 3, hit));
    return hit.range - 0.995;
  };
  double square = 0;
  double near = 0;
  double far = 0;
  for (double x = -1.8; x < 1.4; x += 0.1) {
    for (double y = -1.8; y < 1.8; y += 0.1) {
      square += std::pow(height(x, y), 2);
      near += height(x, y) * height(x + 0.2, y);
      far += height(x, y) * height(x + 0.5, y);
    }
  }
  CHECK(near / square == Approx(std::exp(-0.5)).margin(0.12));
  CHECK(far / square == Approx(std::exp(-0.5 * 6.25)).margin(0.15));
}

TEST_CASE("joints stand within the world's range and their own; without a joint nothing turns") {
  const Target target = satellite();
  TargetDepartures departures;
  departures.joints = radians(15);
  double low = 1;
  double high = -1;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const TrueTarget truth = draw_true_target(target, departures, seed);
    CHECK(truth.parts[1].angle == 0);
    low = std::min(low, truth.parts[2].angle);
    high = std::max(high, truth.parts[2].angle);
    const double tip = bounding_box(truth.target.mesh).size().maxCoeff();
    CHECK(tip > 0);
  }
  CHECK(low < radians(-12));
  CHECK(low >= radians(-15));
  CHECK(high == Approx(radians(2)));  // its rest is at 18 of 20 degrees
}

TEST_CASE("a part is missing or there is one too many, and half of the surface stays") {
  const Target target = satellite();
  TargetDepartures departures;
  departures.missing = 0.5;
  departures.extra = 0.5;
  int missing = 0;
  const double whole = area_of(target.mesh);
  const Box box = bounding_box(target.mesh);
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const TrueTarget truth = draw_true_target(target, departures, seed);
    const double area = area_of(truth.target.mesh);
    const bool has_extra = truth.extra_size != Vector3d::Zero();
    CHECK(truth.missing.empty() == has_extra);  // one or the other
    CHECK(truth.target.part_of.size() == truth.target.mesh.triangles.size());
    if (!truth.missing.empty()) {
      ++missing;
      CHECK(area >= 0.5 * whole);
      CHECK(area < whole);
      CHECK(truth.missing != "body");  // more than half
    } else {
      CHECK(truth.extra_size.maxCoeff() <= 0.2 * target.length);
      CHECK(truth.target.parts.size() == target.parts.size() + 1);
      // It stands on the surface, and mostly outside of it.
      const RayCaster described(target.mesh);
      const Vector3d foot = truth.extra * Vector3d(0, 0, -0.45 * truth.extra_size.z());
      CHECK((described.nearest(foot) - foot).norm() < 1e-6);
      const Vector3d top = truth.extra * Vector3d(0, 0, 0.5 * truth.extra_size.z());
      const bool inside_body = (top.array().abs() < 0.5).all();
      CHECK_FALSE(inside_body);
    }
  }
  CHECK(missing > 15);
  CHECK(missing < 45);
  CHECK(box.size().x() > 0);
}

TEST_CASE("the shipped worlds are read; an unknown key is refused, and so is an unknown world") {
  const WorldSettings exact = load_world("config", "exact");
  CHECK(exact.target.surface == 0);
  CHECK(exact.cell.base_position == 0);
  CHECK_FALSE(exact.scanner.footprint);
  const WorldSettings lab = load_world("config", "lab");
  CHECK(lab.target.surface == 1);
  CHECK(lab.target.joints == Approx(radians(3)));
  CHECK(lab.scanner.footprint);
  CHECK(lab.scanner.range_step == 0.003);
  CHECK(drop_out_at(lab.scanner, 1) == Approx(0.02));
  CHECK(drop_out_at(lab.scanner, std::cos(radians(80))) == Approx(0.5));
  const WorldSettings harsh = load_world("config", "harsh");
  CHECK(harsh.target.soft_surface == 0.008);
  CHECK(harsh.scanner.range_bias == 2 * lab.scanner.range_bias);
  CHECK(load_world("config", "biased").scanner.range_bias == 0.005);
  CHECK(load_world("config", "wrong").cell.controller_clock == 0.02);
  CHECK_THROWS_WITH(load_world("config", "mars"), Catch::Contains("biased, exact, harsh"));
}
