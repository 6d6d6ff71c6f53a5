// SPDX-License-Identifier: BSD-3-Clause
#include "test/estimator/scan_maker.h"

#include <algorithm>
#include <cmath>

#include "evaluation/trials/world.h"

namespace berth::estimator {

ScanMaker::ScanMaker(const Mesh& mesh, std::uint64_t seed)
    : scene_(mesh), receiver_({}, {}, seed) {}

std::vector<RawBeam> ScanMaker::measure(const std::vector<Window>& windows) {
  receiver_.beam = beam;
  receiver_.settings.errors.footprint = footprint;
  receiver_.settings.errors.returns = beam.second_returns ? 2 : 1;
  scene_.place(utime, pose, velocity);
  return trials::sweep(receiver_, scene_, windows, utime, rate_hz).beams;
}

RawBeam ScanMaker::shoot(double azimuth, double elevation) {
  return measure({{azimuth, elevation, 0, 0, Pattern::raster, 1, 0, ""}}).front();
}

std::vector<RawBeam> ScanMaker::sweep(const std::vector<Window>& windows) {
  std::vector<RawBeam> scan = measure(windows);
  utime += std::llround(1e6 * static_cast<double>(scan.size()) / rate_hz);
  pose = scene_.pose_at(utime);
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

Target described(const Mesh& mesh) {
  Target target;
  target.mesh = mesh;
  target.part_of.assign(mesh.triangles.size(), 0);
  target.description_hash = "described";
  target.hash = content_hash(mesh);
  target.length = bounding_box(mesh).size().maxCoeff();
  return target;
}

std::shared_ptr<const TargetModel> coarse_model(const Target& target) {
  return compile_target_model(target, {200, 1, 8, 1000, 0.1, 0.05, 20});
}

std::vector<RawBeam> sweep_around(ScanMaker& lidar, const Mesh& mesh, int count) {
  Window window = trials::window_around(mesh, lidar.pose, 0.1);
  window.count = count;
  return lidar.sweep({window});
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

Window full_view(int count) {
  return {0, 0, radians(40), radians(40), Pattern::raster, count, 0, "full"};
}

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
          Pattern::raster,
          count,
          0,
          "around"};
}

}  // namespace berth::estimator
