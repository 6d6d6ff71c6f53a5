// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beam_selection.h"

#include <utility>

namespace berth::estimator {

namespace {

/// Of each of some that stand for all.
double weight_of(const BeamPicks& some, std::size_t all) {
  return some.empty() ? 1 : static_cast<double>(all) / static_cast<double>(some.size());
}

}  // namespace

BeamPicks evenly(const BeamPicks& from, std::size_t most) {
  const std::size_t stride = 1 + from.size() / (most + 1);
  BeamPicks picks;
  picks.reserve(from.size() / stride + 1);
  for (std::size_t i = 0; i < from.size(); i += stride) picks.push_back(from[i]);
  return picks;
}

BeamSample sample(const BeamPicks& from, std::size_t most) {
  BeamPicks picks = evenly(from, most);
  const double weight = weight_of(picks, from.size());
  return {std::move(picks), weight};
}

BeamPicks evenly(std::size_t count, std::size_t most) {
  const std::size_t stride = 1 + count / (most + 1);
  BeamPicks picks;
  picks.reserve(count / stride + 1);
  for (std::size_t i = 0; i < count; i += stride) picks.push_back(static_cast<std::uint32_t>(i));
  return picks;
}

BeamSelection select_beams(const CleanScan& scan, std::size_t few, std::size_t most_empty) {
  BeamSelection selection;
  selection.few = evenly(scan.beam_of_point, few);
  const auto beams = static_cast<std::uint32_t>(scan.beams.size());
  const auto misses = static_cast<std::size_t>(scan.misses);
  if (scan.points.size() + misses == beams) {
    selection.all = scan.beam_of_point;
  } else {  // some returned from outside the gate
    for (std::uint32_t i = 0; i < beams; ++i) {
      if (scan.beams[i].hit()) selection.all.push_back(i);
    }
  }
  const auto stride = static_cast<std::uint32_t>(1 + misses / (most_empty + 1));
  BeamPicks& empty = selection.empty.picks;
  for (std::uint32_t i = 0; i < beams; i += stride) {
    if (!scan.beams[i].hit()) empty.push_back(i);
  }
  selection.empty.weight = weight_of(empty, misses);
  return selection;
}

}  // namespace berth::estimator
