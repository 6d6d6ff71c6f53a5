// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/trials/world.h"

#include <algorithm>
#include <cmath>

#include "drivers/simulated/true_target.h"

namespace berth::trials {
namespace {

/// A bare mesh as it might really be.
Mesh departed(const Mesh& mesh, double sigma, Random& random) {
  Target target;
  target.mesh = mesh;
  TargetDepartures departures;
  departures.rigid_surface = sigma;
  return draw_true_target(target, departures, random.bits()).target.mesh;
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
  physics.scanner.footprint = true;
  physics.scanner.outliers = 0.01;
  physics.scanner.drop_out = 0.02;
  physics.scanner.drop_out_grazing = 0.2;
  physics.mesh_sigma_m = 0.002;
  return physics;
}

World::World(const Mesh& mesh, const Physics& physics, Random random, const Mesh& clutter)
    : World(std::make_shared<RayCaster>(departed(mesh, physics.mesh_sigma_m, random)), physics,
            clutter) {}

World::World(std::shared_ptr<const RayCaster> surface, const Physics& physics, const Mesh& clutter)
    : physics_(physics), scene_(std::move(surface)) {
  if (!clutter.triangles.empty()) scene_.add_clutter(clutter);
}

Scan World::sweep(const std::vector<Window>& windows, const Pose& start, const Velocity& velocity,
                  std::int64_t utime, Random& random) const {
  ReceiverSettings settings;
  settings.errors = physics_.scanner;
  settings.errors.outlier_range = start.position.norm() + 3;
  Receiver receiver(physics_.noise, settings, random.bits());
  MeshScene scene = scene_;
  scene.place(utime, start, velocity);
  Scan scan = trials::sweep(receiver, scene, windows, utime, physics_.rate_hz);
  for (std::size_t i = 0; physics_.clutter > 0 && i < scan.beams.size(); ++i) {
    RawBeam& beam = scan.beams[i];
    if (beam.status != BeamStatus::hit || random.uniform() >= physics_.clutter) continue;
    beam.range = random.uniform(physics_.noise.range_min_m, settings.errors.outlier_range);
    if (scan.faces[i].range > 0) --scan.returns;
    scan.faces[i] = {};
  }
  return scan;
}

Scan sweep(Receiver& receiver, Scene& scene, const std::vector<Window>& windows, std::int64_t utime,
           double rate_hz) {
  Scan scan;
  std::int64_t fired = 0;
  for (const Window& window : windows) {
    for (const auto& [azimuth, elevation] : raster(window)) {
      RawBeam beam;
      beam.utime = utime + std::llround(1e6 * static_cast<double>(fired++) / rate_hz);
      beam.azimuth = azimuth;
      beam.elevation = elevation;
      const Received received = receiver.measure(scene, beam.utime, azimuth, elevation);
      beam.status = received.status;
      beam.range = received.range;
      beam.intensity = received.power;
      beam.second_range = received.second_range;
      beam.second_intensity = received.second_power;
      const bool of_target = received.surface.target;
      scan.beams.push_back(beam);
      scan.faces.push_back(of_target ? TrueFace{received.surface.normal, received.surface.range}
                                     : TrueFace{});
      scan.returns += of_target ? 1 : 0;
    }
  }
  return scan;
}

double World::expected_returns(const std::vector<Window>& windows, const Pose& pose,
                               int max_beams) const {
  int total = 0;
  for (const Window& w : windows) total += w.count;
  const double thinning = std::max(1.0, static_cast<double>(total) / max_beams);
  MeshScene scene = scene_;
  scene.place(0, pose);
  double expected = 0;
  for (Window window : windows) {
    const double requested = window.count;
    window.count = std::max(20, static_cast<int>(window.count / thinning));
    int hits = 0;
    const auto beams = raster(window);
    SceneHit hit;
    for (const auto& [azimuth, elevation] : beams) {
      scene.cast(0, beam_direction(azimuth, elevation), physics_.noise.range_max_m, hit);
      if (hit.target && hit.range >= physics_.noise.range_min_m) ++hits;
    }
    expected += requested * hits / static_cast<double>(beams.size());
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
  return {0.5 * (low[0] + high[0]),
          0.5 * (low[1] + high[1]),
          size[0],
          size[1],
          Pattern::raster,
          1,
          0,
          "around"};
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
