// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <optional>

namespace berth::estimator {

/// Shares of beams, as a mixture has them: nuisances of a scan.
struct BeamShares {
  double outlier = 0.02;  ///< of beams with a range of nothing in particular
  /// Of beams that meet the target and do not return, by the cosine of incidence in quarters.
  std::array<double, 4> drop_out = {0.1, 0.05, 0.03, 0.03};
  double background = 0.5;  ///< of beams that pass the target and return from behind it
  /// Logarithm of the intensity of a white surface square on at 1 m, once returns have shown it.
  std::optional<double> white;

  double drop_out_at(double cosine) const {
    return drop_out[static_cast<std::size_t>(std::fmin(3.0, std::fmax(0.0, 4 * cosine)))];
  }
};

/// What one beam may meet: a face, as far as its range tells. Nothing: the background.
struct ExpectedReturn {
  double residual = 0;  ///< m: range read, less the range expected
  double variance = 1;  ///< m^2, of residual
  double drop_out = 0;  ///< probability that nothing returns
  double light = 1;     ///< density of its intensity, over that of the intensity of anything
  double coverage = 1;  ///< probability that it is met; of what is behind all others it is the rest
};

/// The likelihood of one beam and what it says of its parts; log L and its derivatives.
struct BeamTerm {
  double log_likelihood = 0;
  double front = 0;   ///< probability that the range is the front face's
  double beside = 0;  ///< ... the face's on the other side of a slit
  double behind = 0;  ///< ... the face's behind it
  double missed = 0;  ///< probability that it met a face and did not return
  double passed = 0;  ///< probability that it met the background
  double outlier = 0;
  double coverage_score = 0;  ///< d log L / d c
  double beside_score = 0;    ///< d log L / d c of the face beside
};

/// The mixture of a beam range finder [Thrun, Burgard, Fox, Probabilistic Robotics, ch. 6] at an
/// occluding edge: with coverage c (probability that the beam meets the front face f, not what is
/// behind, g), range z or nothing,
///   L = c A + (1 - c) G,
///   A = (1 - p_d - p_o) N(z; r_f, s_f^2) light + p_o / U,   G the same of g,
///       or (1 - p_o) p_b / 2U + p_o / U for the background;
///   nothing returned: A = p_d, G the same of g, or (1 - p_o) (1 - p_b) for the background.
/// Of a slit between two faces, L = c1 A1 + c2 A2 + (1 - c1 - c2) G.
/// @param depth U, m: over which ranges of nothing in particular are spread
inline BeamTerm beam_term(bool returned, const ExpectedReturn& front,
                          const std::optional<ExpectedReturn>& beside,
                          const std::optional<ExpectedReturn>& behind, const BeamShares& shares,
                          double depth) {
  constexpr double least = 1e-300;
  const auto normal = [](const ExpectedReturn& r) {
    return r.light * std::exp(-0.5 * r.residual * r.residual / r.variance) /
           std::sqrt(6.283185307179586 * r.variance);
  };
  const double other = beside ? beside->coverage : 0;
  const double rest = 1 - front.coverage - other;
  BeamTerm term;
  if (!returned) {
    const double a = front.drop_out;
    const double b = beside ? beside->drop_out : 0;
    const double g = behind ? behind->drop_out : (1 - shares.outlier) * (1 - shares.background);
    const double sum = front.coverage * a + other * b + rest * g + least;
    term.log_likelihood = std::log(sum);
    term.coverage_score = (a - g) / sum;
    term.beside_score = (b - g) / sum;
    term.missed = (front.coverage * a + other * b + (behind ? rest * g : 0)) / sum;
    term.passed = behind ? 0 : rest * g / sum;
    return term;
  }
  const auto from = [&](const ExpectedReturn& face) {
    return std::fmax(0.0, 1 - face.drop_out - shares.outlier) * normal(face);
  };
  const double stray = shares.outlier / depth;
  const double a = from(front);
  const double b = beside ? from(*beside) : 0;
  const double g = behind ? from(*behind) : (1 - shares.outlier) * shares.background / (2 * depth);
  const double sum = front.coverage * a + other * b + rest * g + stray + least;
  term.log_likelihood = std::log(sum);
  term.coverage_score = (a - g) / sum;
  term.beside_score = (b - g) / sum;
  term.front = front.coverage * a / sum;
  term.beside = other * b / sum;
  (behind ? term.behind : term.passed) = rest * g / sum;
  term.outlier = stray / sum;
  return term;
}

}  // namespace berth::estimator
