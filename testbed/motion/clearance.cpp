// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/motion/clearance.h"

#include <fcl/geometry/shape/convex.h>
#include <fcl/narrowphase/distance.h>

#include <limits>
#include <vector>

namespace berth::testbed {
namespace {

/// The part of a polygon on one side of a plane across an axis: sign * (p[axis] - at) >= 0.
std::vector<Vector3d> clipped(const std::vector<Vector3d>& polygon, int axis, double at,
                              double sign) {
  std::vector<Vector3d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d& a = polygon[i];
    const Vector3d& b = polygon[(i + 1) % polygon.size()];
    const double side_a = sign * (a[axis] - at);
    const double side_b = sign * (b[axis] - at);
    if (side_a >= 0) kept.push_back(a);
    if ((side_a > 0 && side_b < 0) || (side_a < 0 && side_b > 0)) {
      kept.push_back(a + (b - a) * (side_a / (side_a - side_b)));
    }
  }
  return kept;
}

constexpr int target_slices = 10;
/// A box needs some thickness to be a body.
constexpr double min_thickness = 1e-3;

enum class Party { room, replica, sensor };

/// The link number of what an arm holds: behind its last joint.
constexpr int held_link = 7;

struct Body {
  std::string name;
  Party party = Party::room;
  int link = 0;  // of its arm; held_link: mount, target, housing
  bool target = false;
  std::shared_ptr<fcl::Convexd> shape;
  Vector3d centre = Vector3d::Zero();  // of the bounding box in the link's frame
  Vector3d half = Vector3d::Zero();
  fcl::Transform3d placement = fcl::Transform3d::Identity();  // in the cell, for the joints given
  Vector3d low = Vector3d::Zero();
  Vector3d high = Vector3d::Zero();
};

struct PairOfBodies {
  std::size_t a = 0;
  std::size_t b = 0;
  double limit = 0;
  bool between = false;  // different parties
};

Body make_body(const std::string& name, Party party, int link, const Mesh& mesh) {
  Body body;
  body.name = name;
  body.party = party;
  body.link = link;
  auto vertices =
      std::make_shared<std::vector<fcl::Vector3d>>(mesh.vertices.begin(), mesh.vertices.end());
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& triangle : mesh.triangles) {
    faces->push_back(3);
    for (const std::uint32_t vertex : triangle) faces->push_back(static_cast<int>(vertex));
  }
  body.shape =
      std::make_shared<fcl::Convexd>(vertices, static_cast<int>(mesh.triangles.size()), faces);
  const Box box = bounding_box(mesh);
  body.centre = box.centre();
  body.half = 0.5 * box.size();
  return body;
}

void place(Body& body, const Pose& pose) {
  body.placement.linear() = pose.rotation.toRotationMatrix();
  body.placement.translation() = pose.position;
  const Vector3d centre = body.placement * body.centre;
  const Vector3d half = body.placement.linear().cwiseAbs() * body.half;
  body.low = centre - half;
  body.high = centre + half;
}

double box_distance(const Body& a, const Body& b) {
  const Vector3d gap = (a.low - b.high).cwiseMax(b.low - a.high).cwiseMax(0.0);
  return gap.norm();
}

double exact_distance(const Body& a, const Body& b) {
  fcl::DistanceRequestd request;
  fcl::DistanceResultd result;
  try {
    const double distance =
        fcl::distance(a.shape.get(), a.placement, b.shape.get(), b.placement, request, result);
    return std::max(distance, 0.0);
  } catch (const std::exception&) {
    // FCL gives up on a few degenerate configurations; their boxes are the safe answer
    return box_distance(a, b);
  }
}

}  // namespace

std::vector<Box> cover_with_boxes(const Mesh& mesh, int slices) {
  const Box bounds = bounding_box(mesh);
  int axis = 0;
  bounds.size().maxCoeff(&axis);
  const double width = bounds.size()[axis] / slices;
  std::vector<Box> boxes;
  for (int slice = 0; slice < slices; ++slice) {
    const double low = bounds.low[axis] + slice * width;
    const double high = low + width;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    Box box{Vector3d::Constant(infinity), Vector3d::Constant(-infinity)};
    for (const auto& triangle : mesh.triangles) {
      std::vector<Vector3d> polygon;
      polygon.reserve(triangle.size());
      for (const std::uint32_t vertex : triangle) polygon.push_back(mesh.vertices[vertex]);
      double min_coordinate = infinity;
      double max_coordinate = -infinity;
      for (const Vector3d& vertex : polygon) {
        min_coordinate = std::min(min_coordinate, vertex[axis]);
        max_coordinate = std::max(max_coordinate, vertex[axis]);
      }
      if (max_coordinate < low || min_coordinate > high) continue;
      if (min_coordinate < low) polygon = clipped(polygon, axis, low, 1);
      if (max_coordinate > high) polygon = clipped(polygon, axis, high, -1);
      for (const Vector3d& vertex : polygon) {
        box.low = box.low.cwiseMin(vertex);
        box.high = box.high.cwiseMax(vertex);
      }
    }
    if (box.low.x() <= box.high.x()) boxes.push_back(box);
  }
  return boxes;
}

struct Clearance::Impl {
  const Cell* cell;
  Limits limits;
  std::vector<Body> bodies;
  std::vector<PairOfBodies> pairs;
  std::vector<std::pair<double, std::size_t>> order;  // by the bound on slack
  const PairOfBodies* found = nullptr;                // of the last search's result
  std::array<std::array<double, 6>, 2>
      reach{};  // of each arm's joints: farthest that bodies can be

  Impl(const Cell& the_cell, const Limits& the_limits) : cell(&the_cell), limits(the_limits) {
    for (const RoomBody& part : cell->room) {
      bodies.push_back(make_body(part.name, Party::room, 0, part.mesh));
      place(bodies.back(), {});
    }
    for (const ArmRole role : both_arms) {
      const Party party = role == ArmRole::replica ? Party::replica : Party::sensor;
      const std::string owner = std::string(name_of(role)) + " arm's ";
      for (const ArmBody& part : cell->arm(role).kinematics->bodies()) {
        bodies.push_back(make_body(owner + part.name, party, part.link, part.mesh));
      }
    }
    if (!cell->mount.triangles.empty()) {
      bodies.push_back(make_body("mount", Party::replica, held_link, cell->mount));
    }
    if (!cell->replica.kinematics->bodies().empty()) add_target();
    if (!cell->sensor_housing.triangles.empty()) add_housing();
    for (const ArmRole role : both_arms) find_reach(role);
    choose_pairs();
  }

  /// From each joint's axis along the links, which are rigid, to the farthest corner of what it
  /// moves.
  void find_reach(ArmRole role) {
    const Party party = role == ArmRole::replica ? Party::replica : Party::sensor;
    const PlacedArm& arm = cell->arm(role);
    const std::array<Pose, 7> links = arm.kinematics->link_poses(arm.home);
    for (std::size_t joint = 0; joint < 6; ++joint) {
      double& farthest = reach[role == ArmRole::replica ? 0 : 1][joint];
      for (const Body& body : bodies) {
        if (body.party != party || body.link <= static_cast<int>(joint)) continue;
        double away = (body.centre.cwiseAbs() + body.half).norm();
        for (std::size_t link = joint; link < static_cast<std::size_t>(std::min(body.link, 6));
             ++link) {
          away += distance(links[link], links[link + 1]);
        }
        farthest = std::max(farthest, away);
      }
    }
  }

  void add_target() {
    for (const Box& box : cover_with_boxes(swept_mesh(cell->target), target_slices)) {
      Mesh slice;
      slice.append(make_box(box.size().cwiseMax(min_thickness)),
                   cell->replica.tool * Pose{box.centre(), Quaterniond::Identity()});
      bodies.push_back(make_body("target", Party::replica, held_link, slice));
      bodies.back().target = true;
    }
  }

  /// The housing may be several parts; its envelope is one box.
  void add_housing() {
    const Box box = bounding_box(cell->sensor_housing);
    Mesh envelope;
    envelope.append(make_box(box.size()), {box.centre(), Quaterniond::Identity()});
    bodies.push_back(make_body("sensor", Party::sensor, held_link, envelope));
  }

  void choose_pairs() {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      for (std::size_t j = i + 1; j < bodies.size(); ++j) {
        const Body& a = bodies[i];
        const Body& b = bodies[j];
        const bool between = a.party != b.party;
        const int near = std::min(a.link, b.link);
        const int far = std::max(a.link, b.link);
        if (between) {
          // bodies on the floor are near it
          const bool standing =
              (a.party == Party::room && b.link <= 1) || (b.party == Party::room && a.link <= 1);
          if (standing) continue;
          pairs.push_back({i, j, limits.between, true});
        } else if (a.party != Party::room && far - near > 2) {
          // nearer links are kept apart by the joints' own limits
          pairs.push_back({i, j, limits.within, false});
        }
      }
    }
    order.resize(pairs.size());
  }

  void update(const ArmPair& joints) {
    for (const ArmRole role : both_arms) {
      const PlacedArm& arm = cell->arm(role);
      const Party party = role == ArmRole::replica ? Party::replica : Party::sensor;
      std::array<Pose, 7> links = arm.kinematics->link_poses(joints.of(role));
      for (Pose& link : links) link = arm.base * link;
      for (Body& body : bodies) {
        if (body.party != party) continue;
        place(body, links[static_cast<std::size_t>(std::min(body.link, 6))]);
      }
    }
  }

  /// Nearest first by their boxes, until no other pair can be worse.
  template <class Filter>
  Result search(double enough, bool subtract_limit, const Filter& included) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (!included(pairs[i])) continue;
      const double bound = box_distance(bodies[pairs[i].a], bodies[pairs[i].b]) -
                           (subtract_limit ? pairs[i].limit : 0);
      if (bound < enough) order[count++] = {bound, i};
    }
    std::sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count));
    Result result;
    result.slack = enough;
    found = nullptr;
    for (std::size_t k = 0; k < count && order[k].first < result.slack; ++k) {
      const PairOfBodies& pair = pairs[order[k].second];
      const double distance = exact_distance(bodies[pair.a], bodies[pair.b]);
      const double slack = distance - (subtract_limit ? pair.limit : 0);
      if (slack >= result.slack) continue;
      result = {distance, slack, bodies[pair.a].name, bodies[pair.b].name};
      found = &pair;
    }
    return result;
  }
};

Clearance::Clearance(const Cell& cell, const Limits& limits)
    : impl_(std::make_unique<Impl>(cell, limits)) {}
Clearance::~Clearance() = default;

const Clearance::Limits& Clearance::limits() const { return impl_->limits; }

Clearance::Result Clearance::worst(const ArmPair& joints, double enough) {
  impl_->update(joints);
  return impl_->search(enough, true, [](const PairOfBodies&) { return true; });
}

Clearance::Result Clearance::nearest(const ArmPair& joints, double beyond) {
  impl_->update(joints);
  return impl_->search(beyond, false, [](const PairOfBodies& pair) { return pair.between; });
}

std::optional<Clearance::Closest> Clearance::closest(const ArmPair& joints, double beyond) {
  const Result result = nearest(joints, beyond);
  if (impl_->found == nullptr || result.distance <= 0) return std::nullopt;
  const Body& a = impl_->bodies[impl_->found->a];
  const Body& b = impl_->bodies[impl_->found->b];
  fcl::DistanceRequestd request;
  request.enable_nearest_points = true;
  fcl::DistanceResultd answer;
  try {
    fcl::distance(a.shape.get(), a.placement, b.shape.get(), b.placement, request, answer);
  } catch (const std::exception&) {
    return std::nullopt;  // as in exact_distance()
  }
  return Closest{a.name, b.name, answer.nearest_points[0], answer.nearest_points[1]};
}

double Clearance::min_distance(const ArmPair& joints, double beyond) {
  return nearest(joints, beyond).slack;
}

double Clearance::approach_bound(const ArmPair& a, const ArmPair& b) const {
  double bound = 0;
  for (const ArmRole role : both_arms) {
    const ArmKinematics& arm = *impl_->cell->arm(role).kinematics;
    const auto& reach = impl_->reach[role == ArmRole::replica ? 0 : 1];
    // motor joints: on a parallelogram the pendant's J3 is not the angle between the links
    const Joints from = arm.motor_joints(a.of(role));
    const Joints to = arm.motor_joints(b.of(role));
    for (std::size_t i = 0; i < 6; ++i) {
      const double change = std::abs(from[i] - to[i]);
      bound += arm.is_linear(static_cast<int>(i)) ? change : change * reach[i];
    }
  }
  return bound;
}

}  // namespace berth::testbed
