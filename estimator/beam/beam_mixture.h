// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace berth::estimator {

/// Mixture weights of a scan's beams. They are nuisance parameters, estimated with the pose.
struct BeamShares {
  double outlier = 0.02;  ///< probability of an outlier, whose range is uniform
  /// Probability that a beam on the target does not return, by the cosine of incidence in quarters.
  std::array<double, 4> drop_out = {0.1, 0.05, 0.03, 0.03};
  double background = 0.5;  ///< probability that a beam past the target returns from the background
  /// Logarithm of the intensity that a white surface at 1 m and normal incidence would return;
  /// empty until returns have determined it.
  std::optional<double> white;

  double drop_out_at(double cosine) const {
    return drop_out[static_cast<std::size_t>(std::fmin(3.0, std::fmax(0.0, 4 * cosine)))];
  }
};

/// The return expected of one face that a beam may meet.
struct ExpectedReturn {
  double residual = 0;  ///< m: measured range minus expected range
  double variance = 1;  ///< m^2, of residual
  double drop_out = 0;  ///< probability of no return
  double intensity_ratio =
      1;  ///< density of the intensity given the face, over that of any intensity
  double coverage =
      1;  ///< probability that the beam meets this face; of the rear face unused: the remainder
};

/// The log-likelihood L of one beam, the responsibilities of its components, and derivatives.
struct BeamTerm {
  double log_likelihood = 0;
  double front = 0;        ///< responsibility of the front face, of a range
  double opposite = 0;     ///< ... of the face on the opposite side of a slit
  double behind = 0;       ///< ... of the rear face
  double dropped_out = 0;  ///< probability that the beam met a face and did not return
  double passed = 0;       ///< probability that the beam met the background
  double outlier = 0;
  double coverage_score = 0;  ///< d log L / d c
  double opposite_score = 0;  ///< d log L / d c of the opposite face
};

/// The mixture of a beam range finder [Thrun, Burgard, Fox, Probabilistic Robotics, ch. 6] at an
/// occluding edge. With coverage c (probability that the beam meets the front face f instead of the
/// rear face g) and range z or no return:
///   L = c A + (1 - c) G,
///   A = (1 - p_d - p_o) N(z; r_f, s_f^2) I + p_o / U,   G the same of g,
///       or (1 - p_o) p_b / 2U + p_o / U for the background;
///   no return: A = p_d, G the same of g, or (1 - p_o) (1 - p_b) for the background.
/// At a slit between two faces: L = c1 A1 + c2 A2 + (1 - c1 - c2) G.
/// @param depth U, m: the length over which outliers are uniform
inline BeamTerm beam_term(bool returned, const ExpectedReturn& front,
                          const std::optional<ExpectedReturn>& opposite,
                          const std::optional<ExpectedReturn>& behind, const BeamShares& shares,
                          double depth) {
  constexpr double min_likelihood = 1e-300;
  const auto normal = [](const ExpectedReturn& r) {
    return r.intensity_ratio * std::exp(-0.5 * r.residual * r.residual / r.variance) /
           std::sqrt(6.283185307179586 * r.variance);
  };
  const double other = opposite ? opposite->coverage : 0;
  const double rest = 1 - front.coverage - other;
  BeamTerm term;
  if (!returned) {
    const double a = front.drop_out;
    const double b = opposite ? opposite->drop_out : 0;
    const double g = behind ? behind->drop_out : (1 - shares.outlier) * (1 - shares.background);
    const double sum = front.coverage * a + other * b + rest * g + min_likelihood;
    term.log_likelihood = std::log(sum);
    term.coverage_score = (a - g) / sum;
    term.opposite_score = (b - g) / sum;
    term.dropped_out = (front.coverage * a + other * b + (behind ? rest * g : 0)) / sum;
    term.passed = behind ? 0 : rest * g / sum;
    return term;
  }
  const auto from = [&](const ExpectedReturn& face) {
    return std::fmax(0.0, 1 - face.drop_out - shares.outlier) * normal(face);
  };
  const double stray = shares.outlier / depth;
  const double a = from(front);
  const double b = opposite ? from(*opposite) : 0;
  const double g = behind ? from(*behind) : (1 - shares.outlier) * shares.background / (2 * depth);
  const double sum = front.coverage * a + other * b + rest * g + stray + min_likelihood;
  term.log_likelihood = std::log(sum);
  term.coverage_score = (a - g) / sum;
  term.opposite_score = (b - g) / sum;
  term.front = front.coverage * a / sum;
  term.opposite = other * b / sum;
  (behind ? term.behind : term.passed) = rest * g / sum;
  term.outlier = stray / sum;
  return term;
}

}  // namespace berth::estimator
