// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/receiver/receiver.h"

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
    double max_power = -1;
    const double first = lights[i].range;
    for (; i < count && lights[i].range - first < beam.pulse_length_m; ++i) {
      echo.power += lights[i].power;
      sum += lights[i].power * (lights[i].range - first);
      if (lights[i].power > max_power) {
        max_power = lights[i].power;
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

ScannerErrors read_scanner_errors(Config config) {
  ScannerErrors errors;
  config.optional("footprint", errors.footprint);
  config.optional("returns", errors.returns, within(1, 2));
  if (errors.returns == 2 && !errors.footprint) {
    throw config.error("returns", "expected 1 without `footprint: true`");
  }
  config.optional("range_bias", Dimension::length, errors.range_bias, at_least(0));
  config.optional("range_step", Dimension::length, errors.range_step, at_least(0));
  config.optional("range_walk", Dimension::length, errors.range_walk, at_least(0));
  config.optional("outlier_range", Dimension::length, errors.outlier_range, at_least(0));
  config.optional("drop_out", errors.drop_out, within(0, 1));
  config.optional("drop_out_grazing", errors.drop_out_grazing, within(0, 1));
  config.optional("outliers", errors.outliers, within(0, 1));
  config.finish();
  return errors;
}

double drop_out_at(const ScannerErrors& errors, double cosine) {
  static const double grazing = 1 - std::cos(radians(80));
  const double slant = std::pow((1 - cosine) / grazing, 4);
  return std::min(1.0, errors.drop_out + (errors.drop_out_grazing - errors.drop_out) * slant);
}

void read_receiver(const std::filesystem::path& profile, ReceiverSettings& settings) {
  Config file = Config::load(profile);
  Config config = file.optional_section("receiver");
  config.optional("range_max_reflectivity", settings.range_max_reflectivity, within(0, 1));
  config.raw("pulse_length");  // of the beam model
  config.raw("min_echo");
  config.optional_choice("returns", settings.echoes.last_return,
                         {{"first", false}, {"last", true}});
  config.finish();
}

Receiver::Receiver(const BeamModel& beam_model, const ReceiverSettings& receiver,
                   std::uint64_t seed)
    : beam(beam_model),
      settings(receiver),
      random_(seed, "lidar"),
      glitter_random_(seed, "lidar glitter"),
      sun_random_(seed, "lidar sun"),
      error_random_(seed, "lidar errors") {}

Echoes Receiver::echoes_of(Scene& scene, std::int64_t utime, const Vector3d& direction) {
  if (settings.errors.footprint && beam.footprint(1) > 0) {
    const auto rays = rays_of_beam(direction, beam);
    std::array<SceneHit, rays_per_beam> hits;
    scene.cast(utime, rays, beam.range_max_m, hits);
    return received_echoes(settings.echoes, beam, hits, glitter_random_);
  }
  SceneHit hit;
  scene.cast(utime, direction, beam.range_max_m, hit);
  return received_echoes(settings.echoes, beam, {&hit, 1}, glitter_random_);
}

double Receiver::reported_range(const Echo& echo, double error) const {
  const ScannerErrors& errors = settings.errors;
  double range = echo.range + error + errors.range_bias;
  if (errors.range_walk != 0) range -= errors.range_walk * std::log10(echo.power);
  if (errors.range_step > 0) range = errors.range_step * std::round(range / errors.range_step);
  return std::max(range, 0.0);
}

Received Receiver::measure(Scene& scene, std::int64_t utime, double azimuth, double elevation,
                           const Sunlight& sun) {
  const double angle_scale = settings.noise_scale * angle_noise;
  const double true_azimuth = azimuth + random_.normal(angle_scale * beam.azimuth_sigma_rad);
  const double true_elevation = elevation + random_.normal(angle_scale * beam.elevation_sigma_rad);
  const double range_error =
      random_.normal(settings.noise_scale * range_noise * beam.range_sigma_m);

  Received received;
  const Vector3d direction = beam_direction(true_azimuth, true_elevation);
  const Echoes echoes = echoes_of(scene, utime, direction);
  const Echo* echo = echoes.count > 0 ? &echoes.echo[0] : nullptr;
  const double falloff = settings.echoes.full_scale_range_m / beam.range_max_m;
  const double min_power =
      std::max(settings.range_max_reflectivity * falloff * falloff, settings.min_power);
  if (echo != nullptr && echo->range < beam.range_min_m) {
    received.status = BeamStatus::too_near;
  } else if (echo != nullptr && echo->power >= min_power) {
    const double distance = echo->range / settings.echoes.full_scale_range_m;
    const bool dazzles = echo->power * distance * distance > settings.saturation;
    received.status = dazzles ? BeamStatus::saturated : BeamStatus::hit;
    received.power = echo->power;
  }
  Glare glare;
  if (!sun.dark()) {
    const double draw = sun_random_.uniform();
    const double where = sun_random_.uniform();
    received.background =
        sun_background(settings.sun, sun, direction, echo != nullptr ? &echo->hit : nullptr);
    glare = glare_of(settings.sun, received.background, echo != nullptr ? echo->power : 0);
    if (draw < glare.early + glare.lost) {
      received.status = BeamStatus::miss;
      received.power = 0;
    }
    if (draw < glare.early) {  // noise before the surface is mistaken for it
      const double nearest = beam.range_min_m;
      const double farthest = echo != nullptr ? std::max(nearest, echo->range) : beam.range_max_m;
      received.status = BeamStatus::hit;
      received.range = nearest + where * (farthest - nearest);
    }
  }
  received.range_sigma = beam.range_sigma_m * glare.sigma_scale;
  if (received.status == BeamStatus::hit && received.power > 0) {
    received.range = reported_range(*echo, range_error * glare.sigma_scale);
    received.surface = echo->hit;
  }
  const ScannerErrors& errors = settings.errors;
  if (errors.returns > 1) {
    const double error =
        error_random_.normal(settings.noise_scale * range_noise * received.range_sigma);
    if (received.surface.met() && echoes.count > 1 && echoes.echo[1].power >= min_power) {
      received.second_range = reported_range(echoes.echo[1], error);
      received.second_power = echoes.echo[1].power;
    }
  }
  if (errors.drop_out > 0 || errors.drop_out_grazing > 0 || errors.outliers > 0) depart(received);
  return received;
}

/// Drop-outs and outliers.
void Receiver::depart(Received& received) {
  const ScannerErrors& errors = settings.errors;
  const double lost = error_random_.uniform();
  const double stray = error_random_.uniform();
  const double where = error_random_.uniform();
  const auto nothing = [&] {
    Received none;
    none.range_sigma = received.range_sigma;
    none.background = received.background;
    return none;
  };
  if (received.surface.met() && lost < drop_out_at(errors, received.surface.cosine)) {
    received = nothing();
  }
  if (stray < errors.outliers) {
    received = nothing();
    received.status = BeamStatus::hit;
    received.range = beam.range_min_m + where * (errors.outlier_range - beam.range_min_m);
  }
}

}  // namespace berth
