// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "common/core/random.h"
#include "drivers/simulated/receiver/receiver.h"
#include "drivers/simulated/receiver/scene.h"
#include "estimator/beam/scan.h"
#include "estimator/model/target_model.h"

namespace berth::estimator {

/// A small LIDAR for tests: sweeps a mesh that moves, with the noise of a beam model.
class ScanMaker {
 public:
  explicit ScanMaker(const Mesh& mesh, std::uint64_t seed = 1);

  BeamModel beam;                                 ///< of the world
  Pose pose{{0, 0, 5}, Quaterniond::Identity()};  ///< T_sensor_model at utime
  Velocity velocity;                              ///< sensor frame
  std::int64_t utime = 1735689600000000;          ///< when the next beam is sent
  double rate_hz = 2000;
  bool footprint = false;  ///< beams have the width of the beam model; else they are rays

  /// Something else in the scene, fixed in the sensor frame. The nearer hit counts.
  void add_clutter(const Mesh& mesh) { scene_.add_clutter(mesh); }

  /// Sweeps a window as a raster. Moves utime and pose on.
  std::vector<RawBeam> sweep(const Window& window) { return sweep(std::vector{window}); }
  std::vector<RawBeam> sweep(const std::vector<Window>& windows);
  /// One beam now, as it is: time does not pass.
  RawBeam shoot(double azimuth, double elevation);

 private:
  std::vector<RawBeam> measure(const std::vector<Window>& windows);

  MeshScene scene_;
  Receiver receiver_;
};

/// The beam model that the estimator assumes by default.
inline const BeamModel nominal_beam;
/// The replica and its compiled model, made once per test program, cached in the build directory.
const Target& replica();
std::shared_ptr<const TargetModel> replica_model();
/// A cube of 1 m: no axis to be found.
std::shared_ptr<const TargetModel> cube_model();
/// The paper's pose (section 5.3.1).
extern const Pose paper_pose;
/// A mesh of one described part, which gives the surface's properties.
Target described(const Mesh& mesh);
/// Compiled for methods that need no views of it.
std::shared_ptr<const TargetModel> coarse_model(const Target& target);
/// One raster around a mesh where the LIDAR has it, a tenth wider on every side.
std::vector<RawBeam> sweep_around(ScanMaker& lidar, const Mesh& mesh, int count);
/// Covariance of a pose known so well in every direction: standard deviations, m and rad.
Matrix6d prior(double translation, double rotation);
/// Moved and turned by so much (m, rad) in random directions.
Pose displaced(const Pose& pose, Random& random, double translation, double rotation);
/// Uniformly random attitude at this distance on the boresight.
Pose random_pose(Random& random, double distance);
/// A window that covers the full 40 degree field of view.
Window full_view(int count);
/// A window around all of the model in a pose, clipped to the field of view.
Window around(const TargetModel& model, const Pose& pose, int count);

}  // namespace berth::estimator
