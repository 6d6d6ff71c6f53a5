// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/mesh.h"
#include "common/core/random.h"
#include "drivers/simulated/receiver/receiver.h"
#include "drivers/simulated/receiver/scene.h"
#include "estimator/beam/scan.h"

namespace berth::trials {

using estimator::RawBeam;

/// How the simulated world is. The defaults are the world of the targets: beam noise alone.
struct Physics {
  BeamModel noise;
  double rate_hz = 2000;    ///< beams per second
  ScannerErrors scanner;    ///< outliers lie up to 3 m behind the target, whatever its files state
  double mesh_sigma_m = 0;  ///< of the true surface about the model's, alike over 0.3 m
  double clutter = 0;       ///< share of the returns that come from scattered points
};

/// Beam noise as in cases Error1, Error2 and Error3 of the paper's Table 1.
BeamModel table_1_noise(int error_case);
/// The simulated world apart from the target: all effects of Physics, in moderate amounts.
Physics full_physics(const BeamModel& noise);

/// The piece of surface that a return came from. Sensor frame.
struct TrueFace {
  Vector3d normal = Vector3d::Zero();  ///< unit, against the beam
  double range = 0;                    ///< m, without noise; 0: no return of the target
};

struct Scan {
  std::vector<RawBeam> beams;
  std::vector<TrueFace> faces;  ///< one for each beam
  int returns = 0;              ///< beams that returned from the target
};

/// Sweeps the windows as rasters, row by row; the first beam at utime.
Scan sweep(Receiver& receiver, Scene& scene, const std::vector<Window>& windows, std::int64_t utime,
           double rate_hz);

/// A target in empty space in front of a scanning LIDAR.
class World {
 public:
  /// random: of the mesh's departures from the model. clutter: what else is there, sensor frame.
  World(const Mesh& mesh, const Physics& physics, Random random, const Mesh& clutter = {});
  /// Of a surface that is at hand and departs from nothing: costs nothing.
  World(std::shared_ptr<const RayCaster> surface, const Physics& physics, const Mesh& clutter = {});

  /// start: T_sensor_model at the first beam.
  Scan sweep(const std::vector<Window>& windows, const Pose& start, const Velocity& velocity,
             std::int64_t utime, Random& random) const;
  Scan sweep(const std::vector<Window>& windows, const Pose& pose, Random& random) const {
    return sweep(windows, pose, {}, first_utime, random);
  }
  /// How many of the windows' beams would return from the target without noise. At most
  /// max_beams of them are cast.
  double expected_returns(const std::vector<Window>& windows, const Pose& pose,
                          int max_beams = 4000) const;

  const Physics& physics() const { return physics_; }
  const RayCaster& caster() const { return scene_.target(); }
  static constexpr std::int64_t first_utime = 1735689600000000;

 private:
  Physics physics_;
  MeshScene scene_;  // copied for each sweep: it shares its ray casters
};

/// Directions of a window's beams, row by row.
std::vector<std::pair<double, double>> raster(const Window& window);
/// The smallest window, plus a margin on every side as a share of it, that holds the mesh.
Window window_around(const Mesh& mesh, const Pose& pose, double margin);
/// The same windows with all counts scaled so that about `returns` beams return from the target.
std::vector<Window> scaled_to_returns(const World& world, std::vector<Window> windows,
                                      const Pose& pose, int returns);

}  // namespace berth::trials
