// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/receiver.h"

#include <cmath>

#include "drivers/simulated/lidar/mirror.h"
#include "test/catch.h"
#include "test/drivers/simulated/receiver/wall_scene.h"

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

std::optional<Echo> received(const std::vector<SceneHit>& hits, const BeamModel& beam = {},
                             bool last = false) {
  Random glitter(1, "test");
  EchoSettings settings;
  settings.last_return = last;
  const Echoes echoes = received_echoes(settings, beam, hits, glitter);
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
  CHECK(received(hits, {}, true)->range == Approx(6.0));
  CHECK(received(hits, {}, true)->hit.range == 6.0);
  BeamModel sharp;
  sharp.pulse_length_m = 0.1;
  CHECK(received(split(4, 5.0, 5.2), sharp)->range == Approx(5.0));
}

TEST_CASE("an echo that is weak next to the strongest is lost; a beam without a hit is a miss") {
  CHECK(received(split(1, 5.0, 6.0))->range == Approx(6.0));
  BeamModel keen;
  keen.min_echo = 0.05;
  CHECK(received(split(1, 5.0, 6.0), keen)->range == Approx(5.0));
  CHECK(received(split(1, 5.0, 0))->range == Approx(5.0));  // nothing next to it
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
  double min_power = 1e9;
  double max_power = 0;
  for (int i = 0; i < 1000; ++i) {
    const SceneHit hit{5, 1, -Vector3d::UnitZ(), foil, true};
    const double power = received_echoes({}, {}, {&hit, 1}, glitter).echo[0].power;
    min_power = std::min(min_power, power);
    max_power = std::max(max_power, power);
  }
  CHECK(max_power > 100 * min_power);
}

TEST_CASE("a scanner's errors: bias, steps, walk, drop-outs and outliers, and the others as were") {
  WallScene wall(0);
  const auto measured = [&](const ScannerErrors& errors, double azimuth = 0) {
    ReceiverSettings settings;
    settings.errors = errors;
    Receiver receiver({}, settings, 3);
    std::vector<Received> beams;
    for (int i = 0; i < 4000; ++i) beams.push_back(receiver.measure(wall, i, azimuth, 0));
    return beams;
  };
  wall.half_width = 1000;
  const auto exact = measured({});
  ScannerErrors errors;
  errors.range_bias = 0.02;
  CHECK(measured(errors)[5].range == Approx(exact[5].range + 0.02));
  errors = {};
  errors.range_step = 0.003;
  for (const Received& beam : measured(errors)) {
    CHECK(std::remainder(beam.range, 0.003) == Approx(0).margin(1e-9));
  }
  errors = {};
  errors.range_walk = 0.01;  // 0.5 of white at 5 m: twice full scale
  CHECK(measured(errors)[5].range == Approx(exact[5].range - 0.01 * std::log10(2.0)));

  errors = {};
  errors.drop_out = 0.02;
  errors.drop_out_grazing = 0.5;
  errors.outliers = 0.01;
  const auto count = [&](double azimuth, auto what) {
    const auto beams = measured(errors, azimuth);
    const auto as_were = measured({}, azimuth);
    int found = 0;
    for (std::size_t i = 0; i < beams.size(); ++i) {
      found += what(beams[i], as_were[i]) ? 1 : 0;
    }
    return found / 4000.0;
  };
  const auto lost = [](const Received& is, const Received&) {
    return is.status == BeamStatus::miss;
  };
  const auto stray = [](const Received& is, const Received& was) {
    return is.status == BeamStatus::hit && is.range != was.range && !is.surface.met();
  };
  const auto same = [](const Received& is, const Received& was) { return is.range == was.range; };
  CHECK(count(0, lost) == Approx(0.02).margin(0.008));
  CHECK(count(radians(60), lost) == Approx(0.02 + 0.48 * 0.134).margin(0.015));
  CHECK(count(radians(80), lost) == Approx(0.5).margin(0.03));
  CHECK(count(0, stray) == Approx(0.01).margin(0.005));
  CHECK(count(0, same) > 0.96);
}

TEST_CASE("of a beam that meets two surfaces a scanner of two returns reports both") {
  WallScene scene(0);
  scene.wall_behind = 1;
  ReceiverSettings settings;
  settings.noise_scale = 0;
  settings.errors.footprint = true;
  const auto at_edge = [&](int returns) {
    settings.errors.returns = returns;
    scene.half_width = 1;
    return Receiver({}, settings, 1).measure(scene, 0, std::atan(1.0 / 5), 0);
  };
  CHECK(at_edge(1).second_range == 0);
  const Received two = at_edge(2);
  const double along = std::hypot(1.0, 5.0) / 5;
  CHECK(two.range == Approx(5 * along).margin(0.01));
  CHECK(two.second_range == Approx(6 * along).margin(0.01));
  CHECK(two.second_power > 0);
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
