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

/// Weighted least squares of observations e = J x + a delta + noise, with J of D columns and one
/// offset delta for each of n patches: sums of them.
struct NormalEquations {
  Eigen::MatrixXd information;        ///< D x D: sum w J J'
  Eigen::VectorXd gradient;           ///< D: sum w J e
  Eigen::VectorXd patch_information;  ///< n: N = sum w a^2
  Eigen::VectorXd patch_gradient;     ///< n: g = sum w a e
  Eigen::MatrixXd coupling;           ///< n x D: H = sum w a J'
};

/// One of them, but for J.
struct Observation {
  double weight = 0;
  double residual = 0;  ///< e, at zero offset
  double effect = 0;    ///< a
  int patch = -1;       ///< negative: no patch displaces it
  int piece = -1;       ///< of a share that is not known yet; negative: none
};

/// Observations as they come, and their sums.
class Observations {
 public:
  Observations(Eigen::Index state_size, std::size_t max_count);
  /// The column J of the new observation, zero: to be filled. Valid until the next.
  Eigen::MatrixXd::ColXpr add(const Observation& observation);
  /// @param piece_weights on the weights of each piece's observations
  NormalEquations sums(const std::vector<double>& piece_weights, Eigen::Index patches) const;

 private:
  Eigen::MatrixXd jacobian_;  // a column an observation
  std::vector<Observation> observations_;
};

/// A place of the target that errs as one, by a random offset: of ranges (m) where beams meet the
/// face, or of an occluding edge's place (m, along `direction`).
struct SurfacePatch {
  Vector3d place = Vector3d::Zero();      ///< m, model frame
  Vector3d direction = Vector3d::Zero();  ///< unit: normal of a face, outward of a rim
  double sigma = 0;                       ///< m, of the surface's distance from the mesh
  double correlation_length = 1;          ///< m
  bool rim = false;                       ///< of an occluding edge, not of a face
  double slant = 1;                       ///< of a face, 1 / cos(incidence)
};

/// A number of the cell of a grid of that size (m) that a place lies in: 63 bits.
std::uint64_t cell_of(const Vector3d& place, double size);

/// What displaces patches: Gaussian processes over the mesh, independent of each other, each with a
/// scale q on the sigmas that is learnt. With E = (2 l l' / (l^2 + l'^2))^1.5
/// exp(-|x - x'|^2 / (l^2 + l'^2)) [Paciorek, Schervish, NIPS 2004; exp(-d^2 / 2 l^2) for equal
/// lengths] the covariance of two offsets is
enum class SurfaceField {
  /// The surface displaced by a vector field of independent components, rims with it: s s' m.m' E,
  /// m = n of a rim and -n / cos(incidence) of a face, whose ranges shrink as it comes nearer.
  displacement,
  sight  ///< of faces: s s' E, ranges off alike whatever the incidence (blankets, paint)
};
inline constexpr std::array surface_fields = {SurfaceField::displacement, SurfaceField::sight};
using FieldScales = std::array<double, surface_fields.size()>;

double offset_covariance(SurfaceField field, const SurfacePatch& a, const SurfacePatch& b);
/// Of all fields together.
double offset_covariance(const FieldScales& scales, const SurfacePatch& a, const SurfacePatch& b);

/// The covariance K (n x n) of all patches' offsets, a sum over the fields f of
/// q_f^2 (L_f L_f' + diag(rest_f)): Cholesky decompositions with pivots [Harbrecht, Peters,
/// Schneider, Applied Numerical Mathematics 62 (2012) 428]. A smooth field has far fewer degrees of
/// freedom than patches; what is left out counts as independent of all else.
struct OffsetCovariance {
  struct Field {
    Eigen::MatrixXd factor;  ///< n x rank, m
    Eigen::VectorXd rest;    ///< n, m^2
  };
  std::array<Field, surface_fields.size()> fields;

  OffsetCovariance() = default;
  /// Each field's pivots end where q_f^2 rest is below `share` of the variance 1 / N with which the
  /// observations know each patch's offset: what is left out is lost in their noise.
  OffsetCovariance(const std::vector<SurfacePatch>& patches, const NormalEquations& equations,
                   const FieldScales& scales, double share);
};

/// The same with the offsets marginalised, in closed form; L: the q_f L_f side by side. First the
/// rest, each patch alone, by which N, g and H shrink by 1 + N rest; then
///   S = (K^-1 + N)^-1 = L (1 + L' N L)^-1 L',
///   information = sum w J J' - H' S H,  gradient = sum w J e - H' S g.
class MarginalisedEquations {
 public:
  MarginalisedEquations(NormalEquations equations, const OffsetCovariance& covariance,
                        const FieldScales& scales);
  /// Other scales on the L_f. The rest, small as it is, stays as it was.
  void rescale(const FieldScales& scales);

  const Eigen::MatrixXd& information() const { return information_; }
  const Eigen::VectorXd& gradient() const { return gradient_; }
  /// D x D: of the covariance of gradient() at the true x, which is information(), the part that
  /// the offsets make and not the noise: H' (S - S N S) H.
  Eigen::MatrixXd offsets_share() const;
  /// Of each patch, the offset's most probable value for a given x (D).
  Eigen::VectorXd offsets(const Eigen::VectorXd& x) const;
  /// delta' K^-1 delta of those.
  double offsets_squared(const Eigen::VectorXd& x) const;

  /// Of one field [MacKay, Neural Computation 4 (1992) 415]: squared - determined is the slope of
  /// the log evidence (x and offsets marginalised) with log q, but for what is in the rest.
  struct FieldEvidence {
    double squared = 0;     ///< of its most probable coordinates, which are standard normal before
    double determined = 0;  ///< how many of them the observations determine, x aside
  };
  /// @param p D x D, covariance of x
  std::array<FieldEvidence, surface_fields.size()> evidence(const Eigen::MatrixXd& p,
                                                            const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd coordinates(const Eigen::VectorXd& x) const;

  NormalEquations equations_;
  std::array<Eigen::Index, surface_fields.size()> ranks_{};
  Eigen::VectorXd own_;  // rest / (1 + N rest): what a patch takes alone
  // At scales of 1, N, H, g shrunk by the rest:
  Eigen::MatrixXd l_;        // L, n x rank
  Eigen::MatrixXd between_;  // L' N L, the lower half
  Eigen::MatrixXd h_;        // L' H
  Eigen::VectorXd g_;        // L' g
  Eigen::MatrixXd rigid_;    // information and gradient, a patch's own share taken off
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
