// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/sun_glare.h"

#include <cmath>

#include "test/catch.h"

using namespace berth;

namespace {

const SunGlareSettings settings;
const Vector3d ahead = Vector3d::UnitZ();

Vector3d aside(double angle) { return {std::sin(angle), 0, std::cos(angle)}; }

SceneHit plate(double reflectivity, double specular) {
  SceneHit hit;
  hit.range = 5;
  hit.material = {reflectivity, specular};
  hit.normal = -ahead;
  return hit;
}

}  // namespace

TEST_CASE("no light, no glare") {
  const SceneHit hit = plate(0.5, 0.3);
  CHECK(sun_background(settings, {0, -ahead, true}, ahead, &hit) == 0);
  const Glare glare = glare_of(settings, 0, 0.5);
  CHECK(glare.sigma_scale == 1);
  CHECK(glare.lost == 0);
  CHECK(glare.early == 0);
}

TEST_CASE("the nearer a beam comes to the lamp, the more light; hidden, the lamp does nothing") {
  double before = 0;
  for (const double angle : {40.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.0}) {
    const Sunlight sun{1, aside(radians(angle)), true};
    const double background = sun_background(settings, sun, ahead, nullptr);
    CHECK(background > before);
    before = background;
    CHECK(sun_background(settings, {1, sun.towards, false}, ahead, nullptr) == 0);
    CHECK(sun_background(settings, {0.5, sun.towards, true}, ahead, nullptr) ==
          Approx(background / 2));
  }
  CHECK(before == Approx(settings.in_aperture));
  const Sunlight at_half{1, aside(settings.glare_half_angle), true};
  CHECK(sun_background(settings, at_half, ahead, nullptr) == Approx(settings.in_aperture / 2));
}

TEST_CASE("a surface reflects what falls on it: diffuse by its tilt, specular like a mirror") {
  const auto background = [](double lamp_angle, const SceneHit& hit) {
    const Vector3d towards(std::sin(lamp_angle), 0, -std::cos(lamp_angle));
    return sun_background(settings, {1, towards, false}, ahead, &hit);
  };
  CHECK(background(0, plate(1, 0)) == Approx(settings.lit_surface));
  CHECK(background(radians(60), plate(1, 0)) == Approx(settings.lit_surface / 2));
  CHECK(background(radians(100), plate(1, 0.3)) == 0);  // lit from behind
  // The mirror shows the lamp where angle of incidence and reflection agree: here only at 0.
  CHECK(background(0, plate(0, 0.3)) > 100 * settings.lit_surface);
  CHECK(background(radians(10), plate(0, 0.3)) < 1e-3 * settings.lit_surface);
  // Integrated over all directions the lobe holds what it reflects (normalised to pi / facing).
  double sum = 0;
  constexpr double step = 1e-4;
  for (double a = step / 2; a < 0.5; a += step) {
    sum += background(a, plate(0, 1)) / settings.lit_surface * std::sin(a) * 2 * step;
  }
  CHECK(sum == Approx(1).epsilon(0.02));
}

TEST_CASE("noise, losses and early returns rise together with background over signal") {
  Glare before;
  for (const double background : {0.01, 0.1, 1.0, 10.0, 100.0}) {
    const Glare glare = glare_of(settings, background, 0.5);
    CHECK(glare.sigma_scale == Approx(std::sqrt(1 + background / 0.5)));
    CHECK(glare.sigma_scale > before.sigma_scale);
    CHECK(glare.lost > before.lost);
    CHECK(glare.early > before.early);
    CHECK(glare.lost + glare.early < 1);
    before = glare;
  }
  const Glare half = glare_of(settings, settings.half_lost * 0.5, 0.5);
  CHECK(half.lost + half.early == Approx(0.5));
  CHECK(half.early == Approx(0.5 * settings.early_share));
}

TEST_CASE("the albedo lamp lights what the beam meets from all sides") {
  const SceneHit hit = plate(0.5, 0.3);
  Sunlight lamps;
  CHECK(lamps.dark());
  lamps.albedo = 0.5;
  CHECK_FALSE(lamps.dark());
  CHECK(sun_background(settings, lamps, ahead, &hit) ==
        Approx(0.5 * settings.albedo_surface * 0.8));
  CHECK(sun_background(settings, lamps, ahead, nullptr) == 0);
  lamps.towards = ahead;  // where the sun would be does not matter
  CHECK(sun_background(settings, lamps, ahead, &hit) ==
        Approx(0.5 * settings.albedo_surface * 0.8));
}
