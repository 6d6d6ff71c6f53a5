// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "common/core/cell.h"
#include "drivers/simulated/receiver/receiver.h"
#include "drivers/simulated/true_target.h"
#include "estimator/beam/scan.h"
#include "evaluation/trials/world.h"

namespace berth::benchmark {

using namespace trials;

/// How a world departs from the estimator's model.
struct Departures {
  std::string name;
  /// Of the target itself: the mesh displaced, a part missing or too many.
  TargetDepartures target;
  /// m, 1 sigma: ranges of the target's surface, alike over 0.3 m of it; rims stay in place.
  double blanket = 0;
  bool turned = false;  ///< the appendage, by 8 to 15 deg, either way
  ScannerErrors scanner;
  bool half_hidden = false;  ///< a plate that is much nearer stands before half of the target
  bool another = false;      ///< another target is there: for acquisition alone
  bool once = false;         ///< single scans of 1,000 returns in free space alone
};

/// Each departure alone, between the world that is as modelled (first), with that of users after
/// it, and all of them (last). @param config directory of the configuration, the first call's
const std::vector<Departures>& departure_worlds(const std::filesystem::path& config);

/// The target with its outer end as a part of its own that turns about a hinge: of the side of the
/// longest axis where a fifth of the surface is farther out, from there on. What "turned" turns.
Target with_appendage(Target target);

/// The estimator's description of a target: its mesh alone.
Target bare(Target target);
/// ... or the parts that turn, and how far the surface is from the mesh (m, 1 sigma).
Target described(Target target, double surface_sigma);
/// m, 1 sigma: how far the surface of a world is from the mesh, as a description would state it.
double surface_sigma(const Departures& world);

/// One true world: the target in one pose, at rest, seen by a scanner with its own noise.
class DepartedScene {
 public:
  virtual ~DepartedScene() = default;
  /// T_sensor_model, of the rigid part.
  virtual const Pose& truth() const = 0;
  /// A raster about the target, a margin on every side, of which about so many beams return from
  /// the target. New noise each time.
  virtual Scan scan(int returns) = 0;
  virtual Scan sweep(const std::vector<Window>& windows, std::int64_t utime) = 0;
};

/// Makes true worlds of one target: in empty space, at any attitude, its middle within 0.1 m of
/// 5 m before the sensor; or held by the arm of layout `range`, with mount, arms and walls in view,
/// about as acquisition_survey shows it.
class SceneMaker {
 public:
  /// @param target as load_target() takes it; free it is 3 m long, held as long as its name implies
  /// @param config directory of the configuration
  SceneMaker(const std::filesystem::path& config, const std::string& target, bool held);

  /// As it is where nothing departs, with a part that can turn.
  const Target& target() const { return target_; }
  const BeamModel& noise() const { return noise_; }
  estimator::RangeGate gate() const;
  std::unique_ptr<DepartedScene> make(const Departures& world, Random& random) const;

 private:
  Target target_;
  BeamModel noise_;
  std::shared_ptr<const berth::Cell> cell_;  ///< none: free
};

}  // namespace berth::benchmark
