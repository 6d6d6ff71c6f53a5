// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "common/core/pose.h"

namespace berth::targets {

/// What was found, with its standard deviation.
struct Measured {
  double value = 0;
  double sigma = 0;
};

/// Errors that all means of a view share: of the truth's pose (m, rad, sensor frame, left
/// perturbation t + p, Exp(r) R), and of the scanner's range (m).
using ViewErrors = Eigen::Matrix<double, 7, 1>;

/// The mean departure of some returns from the mesh, along its normal, outwards positive.
struct CellMean {
  std::size_t cell = 0;                      ///< index into SurfaceData::places
  double departure = 0;                      ///< m
  double variance = 0;                       ///< m^2, of the returns' noise
  ViewErrors by_error = ViewErrors::Zero();  ///< d departure / d error of its view
  double by_angle = 0;                       ///< m/rad, d departure / d joint angle
};

/// What scans from about one place tell of a part.
struct SurfaceView {
  std::vector<CellMean> means;
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();  ///< of its errors
};

/// A part's surface as it was seen.
struct SurfaceData {
  std::vector<Vector3d> places;  ///< of the cells, model frame, m
  std::vector<SurfaceView> views;
  double angle_sigma = 0;  ///< rad, a priori, of the joint's angle; 0: there is no joint
};

struct SurfaceFit {
  Measured sigma;               ///< m
  Measured correlation_length;  ///< m
  Measured angle;               ///< rad, beyond where the mesh has the part
};

/// Maximum likelihood of a Gaussian process (Rasmussen and Williams 2006, 5.4.1): departures
/// h ~ N(0, s^2 exp(-d^2 / 2 l^2)) at the cells, d_k = h_cell + by_error . e_view + by_angle a +
/// noise. Errors of views and the joint's angle are marginalised in closed form, which leaves
/// information L and vector b of h; then
///
///     log p = -1/2 [log |I + K L| - b' (K^-1 + L)^-1 b] + const
///
/// is greatest over s in closed search for each l. The standard deviation of l is from its
/// curvature in ln l, that of s from where it has fallen by a half. What it cannot do: lengths
/// below the distance of cells or above the part's size are not told apart from those; a part that
/// departs by less than its means' noise has s = 0 within its sigma, and its l is of the prior ln l
/// ~ N(ln of a third of the part's size, 1).
/// @param data at least 10 cells; several hundred cells take a second
SurfaceFit fit_surface(const SurfaceData& data);

}  // namespace berth::targets
