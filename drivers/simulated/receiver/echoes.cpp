// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/echoes.h"

#include <algorithm>
#include <cmath>

namespace berth {
namespace {

constexpr std::size_t on_ring = rays_per_beam - 1;
constexpr double ring = 0.75;  // of the beam's radius: that of the ring's area, halved

struct Light {
  double range;
  double power;
  const SceneHit* hit;
};

const std::array<std::pair<double, double>, on_ring>& ring_places() {
  static const auto places = [] {
    std::array<std::pair<double, double>, on_ring> all;
    for (std::size_t i = 0; i < on_ring; ++i) {
      const double angle = radians(360) * static_cast<double>(i) / static_cast<double>(on_ring);
      all[i] = {std::cos(angle), std::sin(angle)};
    }
    return all;
  }();
  return places;
}

}  // namespace

std::array<Ray, rays_per_beam> rays_of_beam(const Vector3d& direction, const BeamModel& beam) {
  const double level = std::max(1e-9, std::hypot(direction.x(), direction.z()));
  const Vector3d right(direction.z() / level, 0, -direction.x() / level);
  const Vector3d down = direction.cross(right);
  std::array<Ray, rays_per_beam> rays;
  rays[0] = {Vector3d::Zero(), direction};
  for (std::size_t i = 0; i < on_ring; ++i) {
    const auto [x, y] = ring_places()[i];
    const Vector3d aside = ring * (x * right + y * down);
    rays[i + 1] = {0.5 * beam.aperture_m * aside,
                   (direction + 0.5 * beam.divergence_rad * aside).normalized()};
  }
  return rays;
}

Echoes received_echoes(const EchoSettings& settings, const BeamModel& beam,
                       std::span<const SceneHit> hits, Random& glitter) {
  std::array<Light, rays_per_beam> lights;
  std::size_t count = 0;
  const double share = 1 / static_cast<double>(hits.size());
  for (const SceneHit& hit : hits) {
    if (!hit.met()) continue;
    const double falloff = settings.full_scale_range_m / hit.range;
    const double mirrors = hit.material.specular > 0 ? -std::log(1 - glitter.uniform()) : 0;
    const double power =
        share * returned_share(hit.material, hit.cosine, mirrors) * falloff * falloff;
    lights[count++] = {hit.range, power, &hit};
  }
  std::sort(lights.begin(), lights.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Light& a, const Light& b) { return a.range < b.range; });
  std::array<Light, rays_per_beam> all;  // of each the surface that most of it comes from
  std::size_t found = 0;
  double strongest = 0;
  for (std::size_t i = 0; i < count;) {
    Light echo{0, 0, nullptr};
    double sum = 0;
    double most = -1;
    const double first = lights[i].range;
    for (; i < count && lights[i].range - first < beam.pulse_length_m; ++i) {
      echo.power += lights[i].power;
      sum += lights[i].power * (lights[i].range - first);
      if (lights[i].power > most) {
        most = lights[i].power;
        echo.hit = lights[i].hit;
      }
    }
    if (!(echo.power > 0)) continue;
    echo.range = first + sum / echo.power;
    strongest = std::max(strongest, echo.power);
    all[found++] = echo;
  }
  Echoes echoes;
  for (std::size_t i = 0; i < found && echoes.count < echoes.echo.size(); ++i) {
    const Light& one = all[settings.last_return ? found - 1 - i : i];
    if (one.power < beam.min_echo * strongest) continue;
    echoes.echo[echoes.count++] = {one.range, one.power, *one.hit};
  }
  return echoes;
}

}  // namespace berth
