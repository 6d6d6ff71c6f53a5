// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/mesh.h"
#include "testbed/motion/arm_pair.h"

namespace berth::testbed {

/// Boxes that together cover a mesh: it is sliced across its longest side, each slice is boxed.
/// Slices with nothing in them are left out.
std::vector<Box> cover_with_boxes(const Mesh& mesh, int slices);

/// How near the bodies of the cell come to each other: arms, mount, target, sensor housing, room
/// and keep-outs. Bodies are convex; the target is covered by boxes, a slice of it each. Links of
/// an arm that its joint limits keep apart are not compared.
class Clearance {
 public:
  struct Limits {
    double between = 0.10;  ///< m, bodies of different parties (replica arm, sensor arm, room)
    double within = 0.03;   ///< m, bodies of one arm and what it holds
  };
  struct Result {
    double distance = 0;  ///< m, of the worst pair
    double slack = 0;     ///< distance less that pair's limit, m
    std::string a;        ///< names of the worst pair; empty when nothing is near
    std::string b;
  };

  Clearance(const Cell& cell, const Limits& limits);
  ~Clearance();
  const Limits& limits() const;
  Clearance(const Clearance&) = delete;
  Clearance& operator=(const Clearance&) = delete;

  /// The pair with the least slack. Pairs with more slack than `enough` are not examined closely:
  /// the slack returned is then at least `enough`, with empty names.
  Result worst(const ArmPair& joints, double enough);
  /// The nearest two bodies of different parties; names are empty where none is nearer than
  /// `beyond`, m. The slack is the distance.
  Result nearest(const ArmPair& joints, double beyond);
  /// The same two bodies and where they are nearest to each other, cell frame; nothing where none
  /// is nearer than `beyond`, or where they touch.
  struct Closest {
    std::string a;
    std::string b;
    Vector3d at_a;
    Vector3d at_b;
  };
  std::optional<Closest> closest(const ArmPair& joints, double beyond);
  /// Their distance, m; at most `beyond`.
  double min_distance(const ArmPair& joints, double beyond = 10.0);
  /// Bound on how much closer any two bodies come on the way from one pair of joints to the other,
  /// straight in the joints, m.
  double approach_bound(const ArmPair& a, const ArmPair& b) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth::testbed
