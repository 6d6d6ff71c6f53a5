// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/ray_caster.h"
#include "common/targets/target.h"
#include "evaluation/targets/surface_fit.h"

namespace berth::targets {

/// One return, and where the target truly was when it was measured.
struct TrueReturn {
  Vector3d origin = Vector3d::Zero();      ///< of the beam, m, sensor frame
  Vector3d direction = Vector3d::UnitZ();  ///< unit, sensor frame
  double range = 0;                        ///< m, from the origin
  double range_sigma = 0;                  ///< m, as the LIDAR reports; 0: the beam model's
  double power = 0;                        ///< intensity over its full scale, 0..1; 1: saturated
  Pose pose;                               ///< T_sensor_model, truth
  Matrix6d covariance = Matrix6d::Zero();  ///< of truth: m, rad; sensor frame
  std::size_t run = 0;                     ///< of which it is: 0, 1, ... in order
};

struct MeasurementSettings {
  BeamModel beam;
  /// m, at which a white surface square to the beam returns full intensity.
  double full_scale_range = 10;
};

/// Measured properties of a part. One that could not be measured is absent, and `note` gives the
/// reason.
struct PartMeasurement {
  std::string part;
  std::size_t returns = 0;                     ///< that met it, away from edges
  std::optional<Measured> surface_sigma;       ///< m
  std::optional<Measured> correlation_length;  ///< m
  std::optional<Measured> reflectivity;        ///< diffuse, 0..1
  std::optional<Measured> joint_angle;         ///< rad, as of Joint::rest
  std::string note;
};

/// A return's departure from a plane of the mesh and how it depends on all else.
struct Departure {
  double value = 0;  ///< m, along the normal, outwards positive
  /// d value / d truth's pose (m, rad, sensor frame, left perturbation t + p, Exp(r) R) and range.
  Eigen::Matrix<double, 7, 1> by_error = Eigen::Matrix<double, 7, 1>::Zero();
  double by_angle = 0;  ///< m/rad
};
/// e = n . (R' (q - t) - x), q = origin + range direction: linear in errors of the pose (t + p,
/// Exp(r) R), the range, and the angle by which the part is turned beyond the mesh, which moves its
/// surface by n . (axis x (x - point)).
/// @param hit of the beam on the mesh, model frame; joint: of its part, or nullptr
Departure departure_of(const TrueReturn& seen, const RayHit& hit, const Joint* joint);

/// Surface sigma, correlation length, reflectivity and joint angle of each part, in the order of
/// Target::parts. Returns are laid on the mesh by truth; those that may have met an edge or another
/// surface are left out. Errors common to all parts are estimated from all of them, with the
/// surfaces: of each run a range bias (beam model's range sigma), and truth's pose, whose
/// covariance is taken to be a third constant in the sensor frame (its mount), a third constant in
/// the model frame (the target's), and a third of each view, that is of all scans of a run from
/// about one place (0.1 m, 5 deg). The angle of a joint is searched for over its range first.
/// Reflectivity: the median of power (range / full-scale range)^2 / cosine, at incidences beyond
/// the part's mirrors where there are such; its sigma is that of the mean of patches as seen from
/// each view, and of the incidence, which is known only as well as truth's and the joint's
/// rotation.
/// @param returns in the order of their runs
std::vector<PartMeasurement> measure_parts(const Target& target,
                                           const std::vector<TrueReturn>& returns,
                                           const MeasurementSettings& settings);

}  // namespace berth::targets
