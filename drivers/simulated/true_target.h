// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "common/core/pose.h"
#include "common/core/random.h"
#include "common/targets/target.h"

namespace berth {

/// A smooth random field: three components that are independent of each other, each a Gaussian
/// process of unit variance with the covariance exp(-d^2 / 2 l^2), by random Fourier features
/// [Rahimi and Recht, NIPS 2007].
class SmoothField {
 public:
  /// @param length l, m
  SmoothField(Random random, double length);

  /// @param x m
  Vector3d at(const Vector3d& x) const;

 private:
  static constexpr int count = 200;
  struct Feature {
    Vector3d frequency;
    double phase = 0;
    Vector3d amplitude;
  };
  std::array<Feature, count> features_;
};

/// How the true target departs from its description: section `target` of a world (config/worlds).
/// All zero: not at all.
struct TargetDepartures {
  double surface = 0;                   ///< times the surface_sigma of each part
  std::optional<double> rigid_surface;  ///< m: this sigma instead, for parts that are rigid
  std::optional<double> soft_surface;   ///< m: this sigma instead, for parts with `scan: avoid`
  double joints = 0;   ///< rad: a joint is uniform within so much of its rest, and its range
  double missing = 0;  ///< probability that a part is missing
  /// Probability that there is a part too many. One draw decides both: as far as they sum up to 1
  /// they exclude each other.
  double extra = 0;
  double extra_size = 0.2;  ///< largest side of such a part, in lengths of the target
};

/// @throws InputError.
TargetDepartures read_target_departures(Config config);

/// The true target, and its random draws.
struct TrueTarget {
  /// Mesh and parts as they are; model frame, ports and mount are those of the description.
  Target target;
  struct Part {
    std::string name;
    double sigma = 0;               ///< m, of the displacement of the surface, along each axis
    double correlation_length = 0;  ///< m
    double rms = 0;                 ///< m, along the normal, over the part's area, as it came out
    double angle = 0;               ///< rad by which its joint is turned from its rest
  };
  std::vector<Part> parts;                 ///< as the description's
  std::string missing;                     ///< name of the part that is not there; empty: none
  Vector3d extra_size = Vector3d::Zero();  ///< m, of the box that is one too many; 0: none
  Pose extra;                              ///< T_model_box of its middle
};

/// Draws the true target. Its surface is the mesh displaced by a vector field, so that rims and
/// normals move, too: a Gaussian process of each part whose components are independent of each
/// other, with covariance sigma^2 exp(-d^2 / 2 l^2), by random Fourier features [Rahimi and Recht,
/// NIPS 2007]. Triangles larger than half the shortest correlation length are parted first; a
/// vertex of several parts moves by the mean of their fields, and nothing tears. Then joints turn,
/// a part goes (of the described ones, or of the default part's connected pieces; it leaves at
/// least half of the surface) or a box comes, standing on the surface.
///
/// The same target, departures and seed give the same; each kind draws from a stream of its own.
TrueTarget draw_true_target(const Target& described, const TargetDepartures& departures,
                            std::uint64_t seed);

}  // namespace berth
