// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>

namespace berth::estimator {

constexpr std::size_t edge_nodes_at_most = 128;

/// Points that stand for a normal distribution with mean 0 and unit covariance, each with the same
/// weight. count: 16, 32, 64 or 128. Every second one comes first: that half lies as far apart as
/// all. On a spiral (Vogel 1979), from beam to beam turned by another angle: no side is favoured.
std::span<const Eigen::Vector2d> edge_nodes(std::uint32_t beam, std::size_t count);

}  // namespace berth::estimator
