// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/beams_near.h"

#include <algorithm>
#include <array>

#include "estimator/tracking/moving_frame.h"

namespace berth::estimator {

BeamPicks beams_near(const TargetModel& model, std::span<const Beam> beams, const BeamPicks& picks,
                     const BeamLinearisation& at, double distance) {
  constexpr std::size_t chunk = 64;  // on the stack
  std::array<Ray, chunk> rays;
  std::array<bool, chunk> near;
  MovingFrame frame(at);
  BeamPicks found;
  for (std::size_t first = 0; first < picks.size(); first += chunk) {
    const std::size_t count = std::min(chunk, picks.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      const Beam& beam = beams[picks[first + i]];
      frame.go_to(beam);
      rays[i] = {frame.eye(), frame.turn() * beam.direction};
    }
    model.distances.may_come_near(std::span(rays).first(count), distance, near);
    for (std::size_t i = 0; i < count; ++i) {
      if (near[i]) found.push_back(picks[first + i]);
    }
  }
  return found;
}

}  // namespace berth::estimator
