// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>

#include "app/batch/campaigns/sphere_map.h"
#include "common/core/random.h"
#include "test/catch.h"

namespace berth::campaigns {
namespace {

using std::numbers::pi;

TEST_CASE("cells of the sphere have one area, and each direction is in the cell that holds it") {
  Random random(5, "sphere");
  for (const std::size_t requested : {1u, 12u, 100u, 500u, 2000u}) {
    const SphereGrid grid(requested);
    CHECK(static_cast<double>(grid.size()) > 0.8 * static_cast<double>(requested));
    CHECK(static_cast<double>(grid.size()) < 1.2 * static_cast<double>(requested) + 6);
    for (std::size_t i = 0; i < grid.size(); ++i) {
      const auto& cell = grid.cell(i);
      const double area = (cell.east - cell.west) * (std::sin(cell.north) - std::sin(cell.south));
      CHECK(area == Approx(4 * pi / static_cast<double>(grid.size())).epsilon(1e-9));
    }
    for (int i = 0; i < 1000; ++i) {
      const Vector3d d = random.rotation() * Vector3d::UnitX();
      const auto& cell = grid.cell(grid.cell_at(3 * d));
      const double longitude = std::atan2(d.y(), d.x());
      const double latitude = std::asin(d.z());
      CHECK((longitude >= cell.west - 1e-9 && longitude <= cell.east + 1e-9));
      CHECK((latitude >= cell.south - 1e-9 && latitude <= cell.north + 1e-9));
    }
  }
  const SphereGrid grid(200);
  for (const double sign : {-1.0, 1.0}) {
    CHECK(grid.cell_at({0, 0, sign}) < grid.size());
    CHECK(grid.cell_at({sign, 0, 0}) < grid.size());
    CHECK(grid.cell_at({-1, sign * 0.0, 0}) < grid.size());
  }
}

TEST_CASE("Hammer's projection keeps areas") {
  const auto near = [](std::array<double, 2> p, double x, double y) {
    CHECK(p[0] == Approx(x).margin(1e-12));
    CHECK(p[1] == Approx(y).margin(1e-12));
  };
  near(hammer(0, 0), 0, 0);
  near(hammer(pi, 0), 2 * std::sqrt(2), 0);
  near(hammer(0, pi / 2), 0, std::sqrt(2));
  Random random(7, "hammer");
  constexpr double h = 1e-5;
  for (int i = 0; i < 200; ++i) {
    const double lon = random.uniform(-3, 3);
    const double lat = random.uniform(-1.5, 1.5);
    const auto a = hammer(lon - h, lat), b = hammer(lon + h, lat);
    const auto c = hammer(lon, lat - h), d = hammer(lon, lat + h);
    const double determinant = ((b[0] - a[0]) * (d[1] - c[1]) - (b[1] - a[1]) * (d[0] - c[0]));
    CHECK(determinant / (4 * h * h) == Approx(std::cos(lat)).epsilon(1e-4));
  }
}

TEST_CASE("at the identity the sensor sees the middle of the map, upright") {
  const auto direction = viewing_direction(Quaterniond::Identity());
  CHECK((direction - Vector3d::UnitX()).norm() < 1e-12);
  CHECK((direction_in_model(direction) + Vector3d::UnitZ()).norm() < 1e-12);
  CHECK(viewing_roll(Quaterniond::Identity()) == Approx(0).margin(1e-12));
  // A picture turned clockwise: about the boresight, which looks away from the viewer.
  const Quaterniond turned(Eigen::AngleAxisd(radians(20), Vector3d::UnitZ()));
  CHECK(degrees(viewing_roll(turned)) == Approx(20));
  CHECK((viewing_direction(turned) - direction).norm() < 1e-12);

  // What is nearest the sensor is what it sees the target from.
  Random random(9, "view");
  for (int i = 0; i < 200; ++i) {
    const Quaterniond q = random.rotation();
    const Vector3d in_model = direction_in_model(viewing_direction(q));
    CHECK((q * in_model).z() == Approx(-1));
    const double turn = random.uniform(-1, 1);
    const Quaterniond about(Eigen::AngleAxisd(turn, Vector3d::UnitZ()));
    CHECK(std::remainder(viewing_roll(about * q) - viewing_roll(q) - turn, 2 * pi) ==
          Approx(0).margin(1e-6));
    const Quaterniond upright = upright_attitude(viewing_direction(q));
    CHECK((viewing_direction(upright) - viewing_direction(q)).norm() < 1e-9);
    CHECK(viewing_roll(upright) == Approx(0).margin(1e-6));
  }
  CHECK((upright_attitude(Vector3d::UnitX()).coeffs() - Quaterniond::Identity().coeffs()).norm() <
        1e-12);
  CHECK((viewing_direction(upright_attitude({0, 0, 1})) - Vector3d::UnitZ()).norm() < 1e-12);
}

}  // namespace
}  // namespace berth::campaigns
