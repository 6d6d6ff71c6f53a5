// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/receiver.h"

#include <cmath>

#include "drivers/simulated/lidar/mirror.h"
#include "test/catch.h"

using namespace berth;

namespace {

SceneHit surface(double range, double reflectivity = 0.5) {
  return {range, 1, -Vector3d::UnitZ(), {reflectivity, 0}, true};
}

/// A beam of which so many rays meet the near surface and the rest the far one; 0: nothing.
std::vector<SceneHit> split(int near_rays, double near, double far, double far_white = 0.5) {
  std::vector<SceneHit> hits;
  for (int i = 0; i < static_cast<int>(rays_per_beam); ++i) {
    const double range = i < near_rays ? near : far;
    hits.push_back(range > 0 ? surface(range, i < near_rays ? 0.5 : far_white) : SceneHit{});
  }
  return hits;
}

std::optional<Echo> received(const std::vector<SceneHit>& hits, EchoSettings settings = {}) {
  Random glitter(1, "test");
  const Echoes echoes = received_echoes(settings, hits, glitter);
  return echoes.count > 0 ? std::optional(echoes.echo[0]) : std::nullopt;
}

}  // namespace

TEST_CASE("a beam's rays fill its footprint: the aperture, and what it diverges") {
  BeamModel beam;
  beam.aperture_m = 0.012;
  beam.divergence_rad = 1e-3;
  for (const Vector3d& aim : {Vector3d(0, 0, 1), Vector3d(0.3, -0.2, 0.9)}) {
    const Vector3d direction = aim.normalized();
    const auto rays = rays_of_beam(direction, beam);
    for (const double range : {0.5, 5.0, 100.0}) {
      Vector3d mean = Vector3d::Zero();
      double variance = 0;  // along one axis across the beam
      for (const Ray& ray : rays) {
        const Vector3d point = ray.origin + range * ray.direction;
        const Vector3d aside = point - point.dot(direction) * direction;
        mean += aside / rays_per_beam;
        variance += aside.squaredNorm() / 2 / rays_per_beam;
        CHECK(aside.norm() <= 0.5 * beam.footprint(range));
      }
      CHECK(mean.norm() < 1e-9 * range);
      // Of an even disc: the same that the estimator counts with.
      CHECK(variance == Approx(std::pow(beam.footprint(range) / 4, 2)).epsilon(0.05));
    }
  }
}

TEST_CASE("two surfaces nearer than a pulse give one range between them, by their light") {
  const auto echo = received(split(4, 5.0, 5.2));
  REQUIRE(echo);
  CHECK(echo->range > 5.08);
  CHECK(echo->range < 5.12);
  // The brighter one draws it.
  CHECK(received(split(4, 5.0, 5.2, 1.0))->range > echo->range + 0.02);
  CHECK(received(split(6, 5.0, 5.2))->range < echo->range - 0.02);
  // All of the light counts.
  CHECK(echo->power == Approx(0.5 * 4 * (1 + std::pow(5.0 / 5.2, 2)) / 2).epsilon(0.01));
}

TEST_CASE("farther apart they give two echoes: the first or the last, as selected") {
  const auto hits = split(4, 5.0, 6.0);
  CHECK(received(hits)->range == Approx(5.0));
  EchoSettings last;
  last.last_return = true;
  CHECK(received(hits, last)->range == Approx(6.0));
  CHECK(received(hits, last)->hit.range == 6.0);
  EchoSettings sharp;
  sharp.pulse_length_m = 0.1;
  CHECK(received(split(4, 5.0, 5.2), sharp)->range == Approx(5.0));
}

TEST_CASE(
    "an echo that is weak beside the strongest is not seen; a beam that meets nothing is a miss") {
  CHECK(received(split(1, 5.0, 6.0))->range == Approx(6.0));
  EchoSettings keen;
  keen.least_echo = 0.05;
  CHECK(received(split(1, 5.0, 6.0), keen)->range == Approx(5.0));
  CHECK(received(split(1, 5.0, 0))->range == Approx(5.0));  // nothing beside it
  CHECK_FALSE(received(split(0, 0, 0)));
}

TEST_CASE(
    "surfaces: paint by its tilt, mirrors where they face the beam, foil with glints and gaps") {
  const Material paint{0.5, 0};
  CHECK(returned_share(paint, 1, 1) == 0.5);
  CHECK(returned_share(paint, 0.5, 1) == 0.25);
  const Material foil{0, 0.6, radians(12)};
  const double facing = returned_share(foil, 1, 1);
  CHECK(facing > 1);  // brighter than white
  CHECK(returned_share(foil, std::cos(radians(50)), 1) < 1e-3 * facing);
  // What the mirrors send back, integrated over all slopes, is what they reflect: over the half
  // sphere of normals, share / (pi/4) * cos^... is a density of slopes.
  double sum = 0;
  constexpr double step = 1e-4;
  for (double a = step / 2; a < 1.2; a += step) {
    const double c = std::cos(a);
    const double density = returned_share(foil, c, 1) * 8 * std::pow(c, 5) / (2 * radians(180));
    sum += density * std::tan(a) / (c * c) * 2 * radians(180) * step;
  }
  CHECK(sum == Approx(0.6).epsilon(0.01));
  // Few mirrors at a time: the echo of foil comes and goes, that of paint does not.
  Random glitter(1, "test");
  double least = 1e9;
  double most = 0;
  for (int i = 0; i < 1000; ++i) {
    const SceneHit hit{5, 1, -Vector3d::UnitZ(), foil, true};
    const double power = received_echoes({}, {&hit, 1}, glitter).echo[0].power;
    least = std::min(least, power);
    most = std::max(most, power);
  }
  CHECK(most > 100 * least);
}

TEST_CASE("the mirror takes longer the farther it goes") {
  const MirrorSettings mirror;
  CHECK(slew_time(mirror, 0) == 0);
  Utime before = mirror.settle;
  for (const double angle : {1e-4, 1e-3, 1e-2, 0.1, 0.3, 0.6}) {
    const Utime time = slew_time(mirror, angle);
    CHECK(time > before);
    // Never faster than acceleration and speed allow.
    const double moving = seconds(time - mirror.settle) + 1e-6;
    CHECK(moving >= 2 * std::sqrt(angle / mirror.acceleration) - 1e-6);
    CHECK(moving * mirror.speed >= angle);
    before = time;
  }
}
