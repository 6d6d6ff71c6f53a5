// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace berth::estimator {

/// Numbers that follow each other, evenly over all that there are (Fibonacci hashing).
inline std::uint32_t spread_evenly(std::uint32_t index) { return index * 2654435769U; }

/// Group 0 has half of a scan's beams, from all over it, 1 a quarter, ...; the last as many as that
/// before it.
inline int group_of(std::uint32_t beam, int groups) {
  return std::min(std::countl_zero(spread_evenly(beam)), groups - 1);
}

/// Calls f(beam) for those of a group, in their order, without looking at the others: from one to
/// the next it is one of three steps (three-distance theorem, Sos 1958).
template <class F>
void for_each_in_group(std::uint32_t beams, int group, int groups, const F& f) {
  const auto within = [=](std::uint32_t beam) { return group_of(beam, groups) == group; };
  const std::uint64_t length = std::uint64_t{1} << (32 - std::min(group + 1, groups - 1));
  std::uint32_t up = 1;  // the least steps that move a hash up, and down, by less than that
  while (spread_evenly(up) >= length) ++up;
  std::uint32_t down = 1;
  while (-spread_evenly(down) >= length) ++down;
  const std::uint32_t less = std::min(up, down);
  const std::uint32_t more = std::max(up, down);
  std::uint32_t beam = 0;
  while (beam < beams && !within(beam)) ++beam;
  while (beam < beams) {
    f(beam);
    beam += within(beam + less) ? less : within(beam + more) ? more : less + more;
  }
}

}  // namespace berth::estimator
