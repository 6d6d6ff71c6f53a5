// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "estimator/scan/preprocessing.h"

namespace berth::estimator {

/// Indices into a scan's beams.
using BeamPicks = std::vector<std::uint32_t>;

/// Every so manieth of `count` beams, so that at most `most` are left.
BeamPicks evenly(std::size_t count, std::size_t most);
BeamPicks evenly(const BeamPicks& from, std::size_t most);

/// Some beams that stand for more of their kind.
struct BeamSample {
  BeamPicks picks;
  double weight = 1;  ///< beams that each stands for
};

/// Spread evenly, at most so many.
BeamSample sample(const BeamPicks& from, std::size_t most);

/// Which beams of a scan a fit looks at, from rough to fine. Most beams of a scan may have met
/// nothing and far from everything: they need not be cast at every step.
struct BeamSelection {
  BeamPicks few;     ///< returns inside the gate, spread evenly
  BeamPicks all;     ///< every return
  BeamSample empty;  ///< of all without one: is the target where nothing was met?
};

/// few: so many at most. most_empty: of the beams without a return.
BeamSelection select_beams(const CleanScan& scan, std::size_t few, std::size_t most_empty);

}  // namespace berth::estimator
