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
};

/// Covariance (m^2) of the offsets of patches a (rows) and b (columns): the mesh is displaced by a
/// vector field whose components are independent Gaussian processes; an offset is its component
/// along the patch's direction n:
///   K_ab = s_a s_b (2 l_a l_b / (l_a^2 + l_b^2))^1.5 exp(-|x_a - x_b|^2 / (l_a^2 + l_b^2)) n_a.n_b
/// [Paciorek, Schervish, NIPS 2004], which for equal lengths is s^2 exp(-d^2 / 2 l^2) n_a.n_b.
Eigen::MatrixXd offset_covariance(const std::vector<SurfacePatch>& a,
                                  const std::vector<SurfacePatch>& b);

/// Weighted least squares of observations e = J x + a delta + noise, with J of D columns and
/// delta ~ N(0, K) one offset of each patch: sums of them.
struct NormalEquations {
  Eigen::MatrixXd information;        ///< D x D: sum w J J'
  Eigen::VectorXd gradient;           ///< D: sum w J e
  Eigen::VectorXd patch_information;  ///< n: sum w a^2
  Eigen::VectorXd patch_gradient;     ///< n: sum w a e
  Eigen::MatrixXd coupling;           ///< n x D: sum w a J'
};

/// The same with the offsets marginalised, in closed form:
///   S = (K^-1 + N)^-1 = K - K N^.5 (I + N^.5 K N^.5)^-1 N^.5 K,
///   information = sum w J J' - H' S H,  gradient = sum w J e - H' S g.
/// Cost: one Cholesky decomposition of n x n.
class MarginalisedEquations {
 public:
  /// @param covariance K, n x n
  MarginalisedEquations(const NormalEquations& equations, const Eigen::MatrixXd& covariance);

  const Eigen::MatrixXd& information() const { return information_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  /// The offsets' most probable values for a given x (D): S (g - H x), and their K^-1 times.
  void offsets(const Eigen::VectorXd& x, Eigen::VectorXd& delta, Eigen::VectorXd& alpha) const;
  /// How many offsets the observations determine: n - tr (I + N^.5 K N^.5)^-1 [MacKay, Neural
  /// Computation 4 (1992) 415], less those that x could make up for; P: covariance of x.
  double determined(const Eigen::MatrixXd& p) const;
  /// By how much x moves for each offset (D x n): P H' (I - S N).
  Eigen::MatrixXd sensitivity(const Eigen::MatrixXd& p) const;

 private:
  const NormalEquations& equations_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd s_coupling_;  // S H
  Eigen::VectorXd s_gradient_;  // S g
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
};

}  // namespace berth::estimator
