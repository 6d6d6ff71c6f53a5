// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/pose.h"

namespace berth::targets {

/// An estimated value with its standard deviation.
struct Measured {
  double value = 0;
  double sigma = 0;
};

/// Errors behind a mean. Of its view alone: of truth's pose. Of all views of its run: of truth's
/// pose as constant in the sensor frame, as constant in the model frame, and the range's bias.
/// Poses are six numbers each, m and rad.
inline constexpr Eigen::Index view_errors = 6;
inline constexpr Eigen::Index run_errors = 13;
using ErrorGradient = Eigen::Matrix<double, view_errors + run_errors, 1>;

/// Information (inverse covariance, and that times the mean) on the errors of all runs, then of all
/// views, which every part of a target shares.
struct ErrorInformation {
  Eigen::MatrixXd matrix;
  Eigen::VectorXd vector;

  ErrorInformation& operator+=(const ErrorInformation& other);
};

/// The mean departure of some returns from the mesh, along its normal, outwards positive.
struct CellMean {
  std::size_t cell = 0;    ///< index into SurfaceData::places
  double departure = 0;    ///< m
  double variance = 0;     ///< m^2, of the returns' noise
  ErrorGradient by_error;  ///< d departure / d errors of its view and run
  double by_angle = 0;     ///< m/rad, d departure / d joint angle
};

/// Information of scans from about one place on a part.
struct SurfaceView {
  std::size_t run = 0;
  std::vector<CellMean> means;
};

/// A part's surface as it was seen.
struct SurfaceData {
  std::vector<Vector3d> places;   ///< of the cells, model frame, m
  std::vector<Vector3d> normals;  ///< of the mesh there, unit
  std::vector<SurfaceView> views;
  std::size_t runs = 1;
  double angle_sigma = 0;  ///< rad, a priori, of the joint's angle; 0: there is no joint
};

struct SurfaceFit {
  Measured sigma;               ///< m
  Measured correlation_length;  ///< m
  Measured angle;               ///< rad, beyond where the mesh has the part
  ErrorInformation errors;      ///< information of the part on them, beyond what was known
};

/// Maximum likelihood of a Gaussian process (Rasmussen and Williams 2006, 5.4.1). The surface is
/// displaced by a field whose components are alike and independent, so that departures along the
/// normals n_i have the covariance K_ij = s^2 n_i . n_j exp(-d^2 / 2 l^2), d_k = h_cell + by_error
/// . e + by_angle a + noise. Errors e and the joint's angle a are marginalised in closed form,
/// which leaves information L and vector b of h; then
///
///     log p = -1/2 [log |I + K L| - b' (K^-1 + L)^-1 b] + const
///
/// is maximised over s in closed search for each l. The standard deviation of l is from its
/// curvature in ln l, that of s from where it has fallen by a half. Limits: lengths below the
/// distance of cells or above the part's size are not distinguished from those; a part that departs
/// by less than its means' noise has s = 0 within its sigma, and its l is of the prior ln l ~ N(ln
/// of a third of the part's size, 1).
/// @param data at least 10 cells; several hundred cells take a second
/// @param known of the errors, from elsewhere: a priori, and from other parts
SurfaceFit fit_surface(const SurfaceData& data, const ErrorInformation& known);

}  // namespace berth::targets
