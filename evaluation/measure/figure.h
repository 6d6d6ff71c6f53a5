// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/measure/criterion.h"

namespace berth::evaluation {

/// A chart of a figure: series of one dimension over a phase, or one statistic of them for each of
/// several phases.
struct FigureChart {
  std::string title;
  /// Measurements that are series, or coordinates of the pose: x y z w p r.
  std::vector<std::string> draw;
  std::optional<Statistic> statistic;                  ///< set: one value for each phase
  std::vector<std::string> phases;                     ///< one, without a statistic
  bool by_sample = false;                              ///< x is the sample's number, not the time
  std::vector<std::string> criteria;                   ///< whose limits are drawn
  std::vector<std::pair<std::string, double>> levels;  ///< other lines, SI
  int line = 0;                                        ///< in the procedure

  /// Of what is drawn.
  berth::Dimension dimension() const;
};

/// A figure for comparison with one of the source of a procedure: our curves, and the source's
/// claims about them.
struct Figure {
  std::string name;     ///< as the source calls it
  std::string caption;  ///< what it shows, and the claim of the source
  std::vector<FigureChart> charts;
  int line = 0;
};

/// A coordinate of a pose by its name, 0 to 5 for x y z w p r.
std::optional<std::size_t> coordinate_named(const std::string& name);

/// Reads the section `figures` of a procedure:
///
///     figures:
///       - name: Figure 9
///         caption: change of pose between static scans
///         charts:
///           - title: translation            # optional
///             draw: [x_step, y_step, z_step]
///             phase: static                 # or, with a statistic, phases: [near, far]
///             over: sample                  # or time, the default; not with a statistic
///             criteria: [translation error] # optional: those whose limits are drawn
///             levels: {exactly 30 mm: -30 mm}
///
/// @throws InputError for names that are none of measurements, statistics or criteria.
std::vector<Figure> read_figures(Config& procedure, const std::vector<Criterion>& criteria);

}  // namespace berth::evaluation
