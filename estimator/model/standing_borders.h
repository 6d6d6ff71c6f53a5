// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/mesh.h"
#include "estimator/model/face_borders.h"

namespace berth::estimator {

/// Of every triangle, where other faces end that stand some centimetres before it, on either side:
/// beams that come past those may meet one or the other, and their ranges do not tell which.
/// Meshes of very many triangles have none: their facets end nearly everywhere. Model frame, m.
class StandingBorders {
 public:
  StandingBorders(const Mesh& mesh, const std::vector<FaceBorders::End>& ends);

  bool none() const { return ends_.empty(); }

  /// Indices of the ends.
  struct Both {
    std::span<const std::uint32_t> front, back;  ///< front: where the triangle's normal points
  };
  Both before(std::uint32_t triangle) const;

 private:
  std::vector<std::uint32_t> first_;  // of each triangle's front, then its back, in ends_
  std::vector<std::uint32_t> ends_;
};

}  // namespace berth::estimator
