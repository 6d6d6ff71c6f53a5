// SPDX-License-Identifier: BSD-3-Clause
#include "test/estimator/scan_maker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace berth::estimator {

ScanMaker::ScanMaker(const Mesh& mesh, std::uint64_t seed)
    : caster_(mesh), random_(seed, "scan-maker") {}

void ScanMaker::add_clutter(const Mesh& mesh) { clutter_.emplace_back(mesh); }

double ScanMaker::range_along(const Vector3d& direction) const {
  const Pose to_model = pose.inverse();
  RayHit hit;
  double range = beam.range_max_m;
  bool found = caster_.cast({to_model.position, to_model.rotation * direction}, range, hit);
  if (found) range = hit.range;
  for (const RayCaster& other : clutter_) {
    if (!other.cast({Vector3d::Zero(), direction}, range, hit)) continue;
    range = hit.range;
    found = true;
  }
  return found ? range : std::numeric_limits<double>::infinity();
}

double ScanMaker::first_echo(const Vector3d& direction) const {
  constexpr int ring = 6;
  constexpr double pulse_m = 0.5;
  std::array<double, ring + 1> ranges{range_along(direction)};
  const double distance = pose.position.norm();
  const double angle = 0.75 * 0.5 * beam.footprint(distance) / distance;
  const Vector3d right = direction.unitOrthogonal();
  const Vector3d up = direction.cross(right);
  for (int i = 0; i < ring; ++i) {
    const double at = radians(360) * i / ring;
    const Vector3d aside = std::cos(at) * right + std::sin(at) * up;
    ranges[static_cast<std::size_t>(i + 1)] = range_along((direction + angle * aside).normalized());
  }
  const double first = *std::min_element(ranges.begin(), ranges.end());
  double sum = 0;
  int count = 0;
  for (const double range : ranges) {
    if (!(range < first + pulse_m)) continue;
    sum += range;
    ++count;
  }
  return count > 0 ? sum / count : first;
}

RawBeam ScanMaker::shoot(double azimuth, double elevation) {
  RawBeam beam_out{utime, 0, azimuth, elevation, BeamStatus::miss};
  const Vector3d direction = beam_direction(azimuth + random_.normal(beam.azimuth_sigma_rad),
                                            elevation + random_.normal(beam.elevation_sigma_rad));
  const double range = footprint ? first_echo(direction) : range_along(direction);
  if (!std::isfinite(range)) return beam_out;
  if (range < beam.range_min_m) {
    beam_out.status = BeamStatus::too_near;
    return beam_out;
  }
  beam_out.status = BeamStatus::hit;
  beam_out.range = range + random_.normal(beam.range_sigma_m);
  return beam_out;
}

std::vector<RawBeam> ScanMaker::sweep(const Window& window) {
  const double spacing = std::sqrt(window.width * window.height / std::max(1, window.count));
  const int columns = std::max(1, static_cast<int>(std::lround(window.width / spacing)));
  const int rows = std::max(1, window.count / columns);
  const double dt = 1 / rate_hz;
  std::vector<RawBeam> scan;
  double elapsed = 0;
  const std::int64_t first = utime;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double u = (c + 0.5) / columns - 0.5;
      const double v = (r + 0.5) / rows - 0.5;
      scan.push_back(
          shoot(window.azimuth + u * window.width, window.elevation - v * window.height));
      elapsed += dt;
      utime = first + static_cast<std::int64_t>(std::lround(elapsed * 1e6));
      pose = moved(pose, velocity, dt);
    }
  }
  return scan;
}

std::vector<RawBeam> ScanMaker::sweep(const std::vector<Window>& windows) {
  std::vector<RawBeam> scan;
  for (const Window& window : windows) {
    const std::vector<RawBeam> part = sweep(window);
    scan.insert(scan.end(), part.begin(), part.end());
  }
  return scan;
}

const Target& replica() {
  static const Target target = load_target("radarsat2", 0);
  return target;
}

std::shared_ptr<const TargetModel> replica_model() {
  static const auto model =
      load_target_model(replica(), {}, std::filesystem::path("build") / "test-models");
  return model;
}

std::shared_ptr<const TargetModel> cube_model() {
  static const auto model = [] {
    Target cube;
    cube.name = "cube";
    cube.mesh = make_box({1, 1, 1});
    cube.hash = content_hash(cube.mesh);
    cube.length = 1;
    ModelOptions coarse;
    coarse.surface_samples = 3000;
    coarse.grid_voxels = 20000;
    return compile_target_model(cube, coarse);
  }();
  return model;
}

const Pose paper_pose = pose_from_xyzwpr({100, -230, 8000, 25, 20, -30});

Matrix6d prior(double translation, double rotation) {
  Vector6d v;
  v << Vector3d::Constant(translation * translation), Vector3d::Constant(rotation * rotation);
  return v.asDiagonal();
}

Pose displaced(const Pose& pose, Random& random, double translation, double rotation) {
  Vector6d d;
  d << translation * random.normal_vector(1).normalized(),
      rotation * random.normal_vector(1).normalized();
  return perturbed(pose, d);
}

Pose random_pose(Random& random, double distance) { return {{0, 0, distance}, random.rotation()}; }

Window full_view(int count) { return {0, 0, radians(40), radians(40), count, "full"}; }

Window around(const TargetModel& model, const Pose& pose, int count) {
  double low[2] = {10, 10};
  double high[2] = {-10, -10};
  for (const SurfaceSample& s : model.surface.samples) {
    double angles[2];
    beam_angles(pose * s.position.cast<double>(), angles[0], angles[1]);
    for (int i = 0; i < 2; ++i) {
      low[i] = std::min(low[i], std::max(angles[i] - 0.01, radians(-20)));
      high[i] = std::max(high[i], std::min(angles[i] + 0.01, radians(20)));
    }
  }
  return {0.5 * (low[0] + high[0]),
          0.5 * (low[1] + high[1]),
          high[0] - low[0],
          high[1] - low[1],
          count,
          "around"};
}

}  // namespace berth::estimator
