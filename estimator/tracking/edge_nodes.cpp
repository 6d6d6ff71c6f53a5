// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_nodes.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "estimator/tracking/beam_groups.h"

namespace berth::estimator {

namespace {

template <std::size_t size>
using Nodes = std::array<Eigen::Vector2d, size>;

template <std::size_t size>
Nodes<size> make_nodes() {
  Nodes<size> nodes;
  const std::size_t half = nodes.size() / 2;
  const auto count = static_cast<double>(nodes.size());
  const double turn = std::numbers::pi * (3 - std::sqrt(5.0));
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const auto along = static_cast<double>(k < half ? 2 * k : 2 * (k - half) + 1);
    const double radius = std::sqrt(-2 * std::log(1 - (along + 0.5) / count));
    const double angle = along * turn;
    nodes[k] = radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    mean += nodes[k] / count;
  }
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (Eigen::Vector2d& node : nodes) {
    node -= mean;
    covariance += node * node.transpose() / count;
  }
  const Eigen::Matrix2d root = covariance.llt().matrixL();
  for (Eigen::Vector2d& node : nodes) node = root.triangularView<Eigen::Lower>().solve(node);
  return nodes;
}

/// Turned, from beam to beam by another angle.
template <std::size_t size>
std::span<const Eigen::Vector2d> nodes_of(std::uint32_t beam) {
  using Turned = std::array<Nodes<size>, 64>;
  static const Turned sets = [] {
    Turned made;
    made.fill(make_nodes<size>());
    for (std::size_t i = 0; i < made.size(); ++i) {
      const double share = static_cast<double>(i) / static_cast<double>(made.size());
      const Eigen::Rotation2Dd turn(2 * std::numbers::pi * share);
      for (Eigen::Vector2d& node : made[i]) node = turn * node;
    }
    return made;
  }();
  // Not the bits that a beam's group is chosen by.
  return sets[(spread_evenly(beam) >> 13U) % sets.size()];
}

}  // namespace

std::span<const Eigen::Vector2d> edge_nodes(std::uint32_t beam, std::size_t count) {
  switch (count) {
    case 16:
      return nodes_of<16>(beam);
    case 32:
      return nodes_of<32>(beam);
    case 64:
      return nodes_of<64>(beam);
    default:
      assert(count == edge_nodes_at_most);
      return nodes_of<edge_nodes_at_most>(beam);
  }
}

}  // namespace berth::estimator
