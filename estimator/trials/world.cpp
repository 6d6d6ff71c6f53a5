// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/trials/world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace berth::trials {
namespace {

/// Two surfaces in one footprint make two echoes when they are farther apart than this.
constexpr double pulse_length_m = 0.5;

/// Vertices in one place move together: a mesh does not tear.
Mesh departed(Mesh mesh, double sigma, Random& random) {
  if (sigma <= 0) return mesh;
  std::map<std::array<double, 3>, Vector3d> shifts;
  for (Vector3d& v : mesh.vertices) {
    const auto [place, fresh] = shifts.try_emplace({v.x(), v.y(), v.z()});
    if (fresh) place->second = random.normal_vector(sigma);
    v += place->second;
  }
  return mesh;
}

}  // namespace

BeamModel table_1_noise(int error_case) {
  BeamModel noise;
  noise.range_sigma_m = error_case == 1 ? 0.01 : 0.02;
  noise.azimuth_sigma_rad = noise.elevation_sigma_rad = error_case == 3 ? 1e-3 : 1e-4;
  return noise;
}

Physics full_physics(const BeamModel& noise) {
  Physics physics;
  physics.noise = noise;
  physics.mixed_pixels = true;
  physics.outliers = 0.01;
  physics.drop_outs = 0.02;
  physics.mesh_sigma_m = 0.002;
  return physics;
}

World::World(const Mesh& mesh, const Physics& physics, Random random, const Mesh& clutter)
    : World(std::make_shared<RayCaster>(departed(mesh, physics.mesh_sigma_m, random)), physics,
            clutter) {}

World::World(std::shared_ptr<const RayCaster> surface, const Physics& physics, const Mesh& clutter)
    : physics_(physics), caster_(std::move(surface)) {
  if (!clutter.triangles.empty()) clutter_.emplace(clutter);
}

bool World::echo(const Pose& to_model, const Vector3d& direction, Echo& out) const {
  RayHit hit;
  out = {};
  double nearest = physics_.noise.range_max_m;
  if (caster_->cast({to_model.position, to_model.rotation * direction}, nearest, hit)) {
    nearest = hit.range;
    out = {hit.range, {to_model.rotation.conjugate() * hit.normal, hit.range}};
  }
  if (clutter_ && clutter_->cast({Vector3d::Zero(), direction}, nearest, hit))
    out = {hit.range, {}};
  return out.range > 0;
}

bool World::mixed_echo(const Pose& to_model, const Vector3d& direction, Echo& out) const {
  constexpr int ring = 6;
  const bool centre_hits = echo(to_model, direction, out);
  // The footprint's half width as an angle depends on a range that is not known before.
  const double range = centre_hits ? out.range : (to_model.position).norm();
  const double angle = 0.5 * physics_.noise.footprint(range) / range;
  const Vector3d across = direction.unitOrthogonal();
  const Vector3d up = direction.cross(across);
  std::array<double, ring + 1> ranges{};
  std::size_t hits = 0;
  Echo nearest = out;
  if (centre_hits) ranges[hits++] = out.range;
  for (int i = 0; i < ring; ++i) {
    const double at = 2 * radians(180) * i / ring;
    Echo side;
    const Vector3d ray =
        (direction + 0.7 * angle * (std::cos(at) * across + std::sin(at) * up)).normalized();
    if (!echo(to_model, ray, side)) continue;
    if (hits == 0 || (!centre_hits && side.range < nearest.range)) nearest = side;
    ranges[hits++] = side.range;
  }
  if (hits < 2) return false;  // too little light comes back
  std::sort(ranges.begin(), ranges.begin() + hits);
  // The first echo that at least two rays make; else the first.
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t i = 0; i < hits; i = last) {
    last = i;
    while (last < hits && ranges[last] - ranges[i] < pulse_length_m) ++last;
    first = i;
    if (last - i >= 2) break;
  }
  double sum = 0;
  for (std::size_t i = first; i < last; ++i) sum += ranges[i];
  out = nearest;
  out.range = sum / static_cast<double>(last - first);
  return true;
}

Scan World::sweep(const std::vector<Window>& windows, const Pose& start, const Velocity& velocity,
                  std::int64_t utime, Random& random) const {
  const BeamModel& noise = physics_.noise;
  Scan scan;
  double elapsed = 0;
  for (const Window& window : windows) {
    for (const auto& [azimuth, elevation] : raster(window)) {
      RawBeam beam;
      beam.utime = utime + static_cast<std::int64_t>(std::lround(elapsed * 1e6));
      beam.azimuth = azimuth;
      beam.elevation = elevation;
      const Vector3d direction =
          beam_direction(azimuth + random.normal(noise.azimuth_sigma_rad),
                         elevation + random.normal(noise.elevation_sigma_rad));
      const Pose to_model = moved(start, velocity, elapsed).inverse();
      elapsed += 1 / physics_.rate_hz;
      Echo found;
      const bool hit = physics_.mixed_pixels ? mixed_echo(to_model, direction, found)
                                             : echo(to_model, direction, found);
      TrueFace face;
      if (hit && found.range < noise.range_min_m) beam.status = BeamStatus::too_near;
      if (hit && found.range >= noise.range_min_m) {
        const double grazing = 1 + direction.dot(found.face.normal);  // 0 at normal incidence
        const double lost = physics_.drop_outs * (1 + 20 * std::pow(grazing, 4));
        if (physics_.drop_outs <= 0 || random.uniform() >= lost) {
          face = found.face;
          beam.status = BeamStatus::hit;
          beam.range = found.range + random.normal(noise.range_sigma_m);
        }
      }
      const double stray =
          beam.status == BeamStatus::hit ? physics_.clutter + physics_.outliers : physics_.outliers;
      if (stray > 0 && random.uniform() < stray) {
        face = {};
        beam.status = BeamStatus::hit;
        beam.range = random.uniform(noise.range_min_m, start.position.norm() + 3);
      }
      if (face.range > 0) ++scan.returns;
      scan.beams.push_back(beam);
      scan.faces.push_back(face);
    }
  }
  return scan;
}

double World::expected_returns(const std::vector<Window>& windows, const Pose& pose,
                               int most_beams) const {
  int total = 0;
  for (const Window& w : windows) total += w.count;
  const double thinning = std::max(1.0, static_cast<double>(total) / most_beams);
  const Pose to_model = pose.inverse();
  double expected = 0;
  for (Window window : windows) {
    const double wanted = window.count;
    window.count = std::max(20, static_cast<int>(window.count / thinning));
    int hits = 0;
    const auto beams = raster(window);
    Echo found;
    for (const auto& [azimuth, elevation] : beams) {
      if (echo(to_model, beam_direction(azimuth, elevation), found) &&
          found.range >= physics_.noise.range_min_m) {
        ++hits;
      }
    }
    expected += wanted * hits / static_cast<double>(beams.size());
  }
  return expected;
}

std::vector<std::pair<double, double>> raster(const Window& window) {
  const double spacing = std::sqrt(window.width * window.height / std::max(1, window.count));
  const int columns = std::clamp(static_cast<int>(std::lround(window.width / spacing)), 1,
                                 std::max(1, window.count));
  const int rows = std::max(1, static_cast<int>(std::lround(1.0 * window.count / columns)));
  std::vector<std::pair<double, double>> beams;
  beams.reserve(static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns));
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      beams.emplace_back(window.azimuth + ((c + 0.5) / columns - 0.5) * window.width,
                         window.elevation - ((r + 0.5) / rows - 0.5) * window.height);
    }
  }
  return beams;
}

Window window_around(const Mesh& mesh, const Pose& pose, double margin) {
  Eigen::Array2d low = Eigen::Array2d::Constant(10);
  Eigen::Array2d high = -low;
  for (const Vector3d& v : mesh.vertices) {
    Eigen::Array2d angles;
    beam_angles(pose * v, angles[0], angles[1]);
    low = low.min(angles);
    high = high.max(angles);
  }
  // The ILRIS-3D's field of view.
  low = low.max(-radians(20));
  high = high.min(radians(20));
  const Eigen::Array2d size = (1 + 2 * margin) * (high - low);
  return {0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), size[0], size[1], 1, "around"};
}

std::vector<Window> scaled_to_returns(const World& world, std::vector<Window> windows,
                                      const Pose& pose, int returns) {
  const double expected = world.expected_returns(windows, pose);
  if (expected <= 0) return windows;
  for (Window& w : windows) {
    w.count = std::max(1, static_cast<int>(std::lround(1.0 * w.count * returns / expected)));
  }
  return windows;
}

}  // namespace berth::trials
