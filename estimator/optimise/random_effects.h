// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "common/core/pose.h"

namespace berth::estimator {

/// Normal equations of weighted least squares with random effects: observations e = J x + a delta +
/// noise, with J of D columns and one offset delta for each of n patches.
struct NormalEquations {
  Eigen::MatrixXd information;        ///< D x D: sum w J J'
  Eigen::VectorXd gradient;           ///< D: sum w J e
  Eigen::VectorXd patch_information;  ///< n: N = sum w a^2
  Eigen::VectorXd patch_gradient;     ///< n: g = sum w a e
  Eigen::MatrixXd coupling;           ///< n x D: H = sum w a J'
};

/// An observation without its row of J.
struct Observation {
  double weight = 0;
  double residual = 0;  ///< e, at zero offset
  double effect = 0;    ///< a
  int patch = -1;       ///< negative: no patch displaces it
  int piece = -1;       ///< whose weight multiplies this one's; negative: none
};

/// Collects observations and sums their normal equations.
class Observations {
 public:
  Observations(Eigen::Index state_size, std::size_t max_count);
  /// The row of J of the new observation, as a column of zeros to be filled. Valid until the next
  /// call.
  Eigen::MatrixXd::ColXpr add(const Observation& observation);
  /// @param piece_weights factors on the weights of each piece's observations
  NormalEquations sums(const std::vector<double>& piece_weights, Eigen::Index patches) const;

 private:
  Eigen::MatrixXd jacobian_;  // a column an observation
  std::vector<Observation> observations_;
};

/// A patch of the target's surface with one random offset: of ranges (m) on a face, or of an
/// occluding edge's position (m, along `direction`).
struct SurfacePatch {
  Vector3d place = Vector3d::Zero();      ///< m, model frame
  Vector3d direction = Vector3d::Zero();  ///< unit: normal of a face, outward direction of an edge
  double sigma = 0;                       ///< m, of the surface's distance from the mesh
  double correlation_length = 1;          ///< m
  bool rim = false;                       ///< on an occluding edge instead of a face
  double slant = 1;                       ///< of a face, 1 / cos(incidence)
};

/// Key of the cell of a cubic grid of that size (m) that contains a point: 63 bits.
std::uint64_t cell_of(const Vector3d& place, double size);

/// Gaussian processes over the mesh that displace patches, independent of each other, each with an
/// estimated scale q on the sigmas. With the nonstationary correlation
///   E = (2 l l' / (l^2 + l'^2))^1.5 exp(-|x - x'|^2 / (l^2 + l'^2))
/// of [Paciorek, Schervish, NIPS 2004] (exp(-d^2 / 2 l^2) for equal lengths) the covariance of two
/// offsets is as follows.
enum class SurfaceField {
  /// s s' m.m' E: the surface is displaced by a vector field with independent components. m = n on
  /// an edge and -n / cos(incidence) on a face.
  displacement,
  line_of_sight  ///< s s' E on faces: range errors independent of incidence (blankets, paint)
};
inline constexpr std::array surface_fields = {SurfaceField::displacement,
                                              SurfaceField::line_of_sight};
using FieldScales = std::array<double, surface_fields.size()>;

double offset_covariance(SurfaceField field, const SurfacePatch& a, const SurfacePatch& b);
/// Sum over the fields.
double offset_covariance(const FieldScales& scales, const SurfacePatch& a, const SurfacePatch& b);

/// The covariance K (n x n) of the patches' offsets, the sum over the fields f of q_f^2 (L_f L_f' +
/// diag(residual_f)): pivoted Cholesky decompositions [Harbrecht, Peters, Schneider, Applied
/// Numerical Mathematics 62 (2012) 428]. A smooth field has far fewer degrees of freedom than
/// patches; the residual is treated as independent.
struct OffsetCovariance {
  struct Field {
    Eigen::MatrixXd factor;    ///< n x rank, m
    Eigen::VectorXd residual;  ///< n, m^2
  };
  std::array<Field, surface_fields.size()> fields;

  OffsetCovariance() = default;
  /// The decomposition of each field ends where q_f^2 residual is below `tolerance` times the
  /// variance 1 / N with which the observations determine each patch's offset.
  OffsetCovariance(const std::vector<SurfacePatch>& patches, const NormalEquations& equations,
                   const FieldScales& scales, double tolerance);
};

/// The normal equations with the offsets marginalised in closed form; L: the q_f L_f side by side.
/// The residuals are marginalised first, patch by patch, which divides N, g and H by 1 + N
/// residual; then
///   S = (K^-1 + N)^-1 = L (1 + L' N L)^-1 L',
///   information = sum w J J' - H' S H,  gradient = sum w J e - H' S g.
class MarginalisedEquations {
 public:
  MarginalisedEquations(NormalEquations equations, const OffsetCovariance& covariance,
                        const FieldScales& scales);
  /// New scales on the L_f. The scales of the residuals are unchanged.
  void rescale(const FieldScales& scales);

  const Eigen::MatrixXd& information() const { return information_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  /// D x D: the part of the covariance of gradient() at the true x (which is information()) that is
  /// made by the offsets, H' (S - S N S) H.
  Eigen::MatrixXd systematic_score_covariance() const;
  /// The most probable offset of each patch for a given x (D).
  Eigen::VectorXd offsets(const Eigen::VectorXd& x) const;
  /// delta' K^-1 delta of those.
  double offsets_squared(const Eigen::VectorXd& x) const;

  /// Evidence of one field's scale [MacKay, Neural Computation 4 (1992) 415]: squared -
  /// well_determined is the derivative of the log evidence (x and offsets marginalised) with
  /// respect to log q, residuals left out.
  struct FieldEvidence {
    double squared = 0;  ///< norm of the most probable coordinates, a priori standard normal
    double well_determined = 0;  ///< effective number of coordinates determined by the observations
  };
  /// @param p D x D, covariance of x
  std::array<FieldEvidence, surface_fields.size()> evidence(const Eigen::MatrixXd& p,
                                                            const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd coordinates(const Eigen::VectorXd& x) const;

  NormalEquations equations_;
  std::array<Eigen::Index, surface_fields.size()> ranks_{};
  Eigen::VectorXd independent_;  // residual / (1 + N residual)
  // At unit scales, N, H, g divided by 1 + N residual:
  Eigen::MatrixXd l_;      // L, n x rank
  Eigen::MatrixXd gram_;   // L' N L, the lower half
  Eigen::MatrixXd h_;      // L' H
  Eigen::VectorXd g_;      // L' g
  Eigen::MatrixXd rigid_;  // information and gradient, residuals marginalised
  Eigen::VectorXd rigid_gradient_;
  // At the scales given:
  Eigen::VectorXd scale_;               // of each column of L
  Eigen::LLT<Eigen::MatrixXd> factor_;  // of 1 + L' N L
  Eigen::MatrixXd coupling_;            // L' H, rank x D
  Eigen::VectorXd patch_gradient_;      // L' g
  Eigen::MatrixXd information_;
  Eigen::VectorXd gradient_;
};

}  // namespace berth::estimator
