// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// A place of a surface that is displaced as one: along `direction`, by a random offset.
struct SurfacePatch {
  Vector3d place = Vector3d::Zero();      ///< m, model frame
  Vector3d direction = Vector3d::Zero();  ///< unit: normal of a face, outward of a rim
  double sigma = 0;                       ///< m, of the offset
  double correlation_length = 1;          ///< m
  bool rim = false;                       ///< of an occluding edge, not of a face
};

/// Covariance (m^2) of the offsets of two patches: the mesh is displaced by a vector field whose
/// components are independent Gaussian processes; an offset is its component along the patch's
/// direction n:
///   K_ab = s_a s_b (2 l_a l_b / (l_a^2 + l_b^2))^1.5 exp(-|x_a - x_b|^2 / (l_a^2 + l_b^2)) n_a.n_b
/// [Paciorek, Schervish, NIPS 2004], which for equal lengths is s^2 exp(-d^2 / 2 l^2) n_a.n_b.
double offset_covariance(const SurfacePatch& a, const SurfacePatch& b);

/// The covariance K (n x n) of all patches' offsets as factor factor' + diag(rest): Cholesky
/// decomposition with pivots, stopped when no rest is above `tolerance` of its variance [Harbrecht,
/// Peters, Schneider, Applied Numerical Mathematics 62 (2012) 428]. A smooth field has far fewer
/// degrees of freedom than patches; what is left out counts as independent of all else.
struct OffsetCovariance {
  Eigen::MatrixXd factor;  ///< n x rank, m
  Eigen::VectorXd rest;    ///< n, m^2

  OffsetCovariance() = default;
  OffsetCovariance(const std::vector<SurfacePatch>& patches, double tolerance);
};

/// Weighted least squares of observations e = J x + a delta + noise, with J of D columns and one
/// offset delta for each of n patches: sums of them.
struct NormalEquations {
  Eigen::MatrixXd information;        ///< D x D: sum w J J'
  Eigen::VectorXd gradient;           ///< D: sum w J e
  Eigen::VectorXd patch_information;  ///< n: N = sum w a^2
  Eigen::VectorXd patch_gradient;     ///< n: g = sum w a e
  Eigen::MatrixXd coupling;           ///< n x D: H = sum w a J'
};

/// The same with the offsets marginalised, in closed form. Their covariance is K = L L' +
/// diag(rest), patch by patch scaled by q. First the rest, each patch alone, by which N, g and H
/// shrink by 1 + N rest; then
///   S = (K^-1 + N)^-1 = L (1 + L' N L)^-1 L',
///   information = sum w J J' - H' S H,  gradient = sum w J e - H' S g.
class MarginalisedEquations {
 public:
  /// @param equations, must outlive it
  /// @param scale q: n factors on the sigmas of the patches
  MarginalisedEquations(const NormalEquations& equations, const OffsetCovariance& covariance,
                        const Eigen::VectorXd& scale);

  const Eigen::MatrixXd& information() const { return information_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  /// Of each patch, the offset's most probable value for a given x (D).
  Eigen::VectorXd offsets(const Eigen::VectorXd& x) const;
  /// Of each patch, delta (K^-1 delta) of those: their sum is delta' K^-1 delta.
  Eigen::VectorXd offsets_squared(const Eigen::VectorXd& x) const;
  /// Of each patch, how much of its offset the observations determine, 0 to 1: (S N)_kk [MacKay,
  /// Neural Computation 4 (1992) 415], less what x could make up for. p: covariance of x.
  /// offsets_squared() less this is the slope of the log evidence with the logarithm of the scale.
  Eigen::VectorXd determined(const Eigen::MatrixXd& p) const;

 private:
  const NormalEquations& equations_;
  Eigen::MatrixXd l_;                   // q L
  Eigen::VectorXd own_;                 // q^2 rest / (1 + N q^2 rest): what a patch takes alone
  Eigen::VectorXd kept_;                // 1 / (1 + N q^2 rest)
  Eigen::LLT<Eigen::MatrixXd> factor_;  // of 1 + L' N L
  Eigen::MatrixXd coupling_;            // L' H, rank x D
  Eigen::VectorXd patch_gradient_;      // L' g
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
};

}  // namespace berth::estimator
