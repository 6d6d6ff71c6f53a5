// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/spherical_wrist.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/core/arm_kinematics.h"
#include "common/core/text.h"

namespace berth {
namespace {

using std::numbers::pi;
/// Rounding must not put a joint beyond a limit on which it stands.
constexpr double limit_tolerance = 1e-9;
/// Below these values the pose does not determine an angle.
constexpr double singular_sine = 1e-9;
constexpr double singular_radius = 1e-9;

bool within(double value, double low, double high) {
  return value >= low - limit_tolerance && value <= high + limit_tolerance;
}

double wrapped(double angle) { return std::remainder(angle, 2 * pi); }

std::string reach_text(double distance, const std::string& verb, double limit) {
  std::string text = "unreachable: the wrist centre is ";
  text += fixed(distance, 3) + " m from the shoulder, the arm " + verb + " ";
  text += fixed(limit, 3) + " m";
  return text;
}

std::string no_turn_text(int joint, double angle, const JointLimit& limit) {
  return "out of limits: J" + std::to_string(joint + 1) + " = " + fixed(degrees(angle), 2) +
         " deg, at no whole turn within " + fixed(degrees(limit.low), 2) + " to " +
         fixed(degrees(limit.high), 2) + " deg";
}

/// before * Rz(theta) Tz(d) Tx(a) Rx(alpha), the twist given as a quaternion (tw, tx, 0, 0). A
/// product of unit quaternions stays one to rounding over so short a chain.
Pose dh_step(const Pose& before, double a, double tw, double tx, double d, double theta) {
  const double c = std::cos(0.5 * theta);
  const double s = std::sin(0.5 * theta);
  const Quaterniond step(c * tw, c * tx, s * tx, s * tw);
  const Vector3d offset(a * (1 - 2 * s * s), a * 2 * s * c, d);
  return {before.rotation * offset + before.position, before.rotation * step};
}

/// A joint turned by whole turns so that it comes within its limits: all possibilities.
class Turns {
 public:
  Turns(double angle, const JointLimit& limit) {
    double turned = angle + 2 * pi * std::ceil((limit.low - limit_tolerance - angle) / (2 * pi));
    for (; count_ < values_.size() && turned <= limit.high + limit_tolerance; turned += 2 * pi) {
      values_[count_++] = turned;
    }
  }
  const double* begin() const { return values_.data(); }
  const double* end() const { return values_.data() + count_; }
  bool empty() const { return count_ == 0; }

 private:
  std::array<double, 8> values_{};
  std::size_t count_ = 0;
};

/// Rotation of DH frame 3: x up across the forearm, z back along it, when J3 is 0.
Matrix3d forearm_frame(const Joints& joints) {
  const double c1 = std::cos(joints[0]);
  const double s1 = std::sin(joints[0]);
  const double c3 = std::cos(joints[2]);
  const double s3 = std::sin(joints[2]);
  Matrix3d m;
  m << -c1 * s3, -s1, -c1 * c3, -s1 * s3, c1, -s1 * c3, c3, 0, -s3;
  return m;
}

/// 0 for -180..180 degrees, both ends included.
int turn_number(double angle) {
  const double turns = std::ceil((std::abs(angle) - pi) / (2 * pi) - 1e-9);
  return turns <= 0 ? 0 : static_cast<int>(std::copysign(turns, angle));
}

}  // namespace

SphericalWristArm::SphericalWristArm(Config& config) {
  Config geometry = config.section("geometry");
  geometry_.a1 = geometry.quantity("a1", Dimension::length);
  geometry_.a2 = geometry.quantity("a2", Dimension::length, above(0));
  geometry_.a3 = geometry.quantity("a3", Dimension::length);
  geometry_.d4 = geometry.quantity("d4", Dimension::length, above(0));
  geometry_.d6 = geometry.quantity("d6", Dimension::length);
  geometry.finish();
  forearm_ = std::hypot(geometry_.a3, geometry_.d4);
  forearm_angle_ = std::atan2(geometry_.a3, geometry_.d4);

  Config coupling = config.section("coupling");
  sum_low_ = coupling.quantity("low", Dimension::angle);
  sum_high_ = coupling.quantity("high", Dimension::angle);
  coupling.finish();
  if (sum_low_ >= sum_high_) throw config.error("coupling", "low must be below high");

  std::vector<Config> joints = config.sections("joints");
  if (joints.size() != limits_.size()) throw config.error("joints", "expected a list of six");
  for (std::size_t i = 0; i < joints.size(); ++i) {
    JointLimit& limit = limits_[i];
    limit.low = joints[i].quantity("low", Dimension::angle);
    limit.high = joints[i].quantity("high", Dimension::angle);
    limit.speed = joints[i].quantity("speed", Dimension::angular_speed, above(0));
    limit.acceleration =
        joints[i].quantity("acceleration", Dimension::angular_acceleration, above(0));
    joints[i].finish();
    if (limit.low >= limit.high) throw joints[i].error("low", "must be below 'high'");
  }
}

std::array<Pose, 7> SphericalWristArm::link_poses(const Joints& joints) const {
  constexpr double half = std::numbers::sqrt2 / 2;
  std::array<Pose, 7> links;
  links[1] = dh_step(links[0], geometry_.a1, half, -half, 0, joints[0]);
  links[2] = dh_step(links[1], geometry_.a2, 0, 1, 0, joints[1] - pi / 2);
  links[3] = dh_step(links[2], geometry_.a3, half, -half, 0, joints[1] + joints[2]);
  links[4] = dh_step(links[3], 0, half, half, -geometry_.d4, joints[3]);
  links[5] = dh_step(links[4], 0, half, -half, 0, joints[4]);
  links[6] = dh_step(links[5], 0, 0, 1, -geometry_.d6, joints[5]);
  return links;
}

Pose SphericalWristArm::forward(const Joints& joints) const { return link_poses(joints)[6]; }

template <class Found, class Closed>
void SphericalWristArm::place_wrist(const Vector3d& wrist, const Found& found,
                                    const Closed& closed) const {
  const double radius = std::hypot(wrist.x(), wrist.y());
  const auto close_elbows = [&](bool front, const auto& text) {
    for (const bool up : {true, false}) closed(front, up, text);
  };
  for (const bool front : {true, false}) {
    if (radius < singular_radius) {
      close_elbows(front, [] {
        return std::string(
            "singular: the wrist centre lies on the axis of J1, so that J1 may be any angle");
      });
      continue;
    }
    const double j1 = wrapped(std::atan2(wrist.y(), wrist.x()) + (front ? 0.0 : pi));
    // the triangle of shoulder, elbow and wrist, in the plane that J1 turns
    const double x = (front ? radius : -radius) - geometry_.a1;
    const double z = wrist.z();
    const double reach = std::hypot(x, z);
    const double max_reach = geometry_.a2 + forearm_;
    const double shortest = std::abs(geometry_.a2 - forearm_);
    if (reach > max_reach * (1 + 1e-12)) {
      close_elbows(front, [&] { return reach_text(reach, "reaches", max_reach); });
      continue;
    }
    if (reach < shortest * (1 - 1e-12) || reach < singular_radius) {
      close_elbows(front, [&] { return reach_text(reach, "folds to", shortest); });
      continue;
    }
    const double cosine = (geometry_.a2 * geometry_.a2 + reach * reach - forearm_ * forearm_) /
                          (2 * geometry_.a2 * reach);
    const double at_shoulder = std::acos(std::clamp(cosine, -1.0, 1.0));
    const double direction = std::atan2(z, x);
    for (const bool up : {true, false}) {
      const double link = direction + (up ? at_shoulder : -at_shoulder);  // above the horizontal
      const double elbow_x = geometry_.a2 * std::cos(link);
      const double elbow_z = geometry_.a2 * std::sin(link);
      const double line = std::atan2(z - elbow_z, x - elbow_x);
      Placement placement{{j1, wrapped(pi / 2 - link), 0, 0, 0, 0}, front, up};
      const double j3 = wrapped(line - forearm_angle_);
      const Turns turns(j3, limits_[2]);
      for (const double turned : turns) {
        placement.joints[2] = turned;
        found(placement);
      }
      if (turns.empty()) closed(front, up, [&] { return no_turn_text(2, j3, limits_[2]); });
    }
  }
}

/// found(solution) for each within the limits; closed(flip, up, front, text) for each branch
/// without a solution, where text() gives the cause.
template <class Found, class Closed>
void SphericalWristArm::solve(const Pose& flange, const Found& found, const Closed& closed) const {
  Matrix3d reference = flange.rotation.toRotationMatrix();
  reference.rightCols<2>() *= -1;  // the last twist undone
  const Vector3d wrist = flange.position - geometry_.d6 * (flange.rotation * Vector3d::UnitZ());
  const auto turn_wrist = [&](const Placement& placement) {
    // what is left for the wrist: Rz(J4) Ry(-J5) Rz(J6)
    const Matrix3d m = forearm_frame(placement.joints).transpose() * reference;
    const double sine = std::hypot(m(0, 2), m(1, 2));
    for (const bool flip : {false, true}) {
      if (sine < singular_sine) {
        closed(flip, placement.up, placement.front, [] {
          return std::string("singular: J5 is 0, so that J4 and J6 turn about one axis");
        });
        continue;
      }
      Joints joints = placement.joints;
      const double sign = flip ? 1.0 : -1.0;  // of J5
      const double j4 = std::atan2(-sign * m(1, 2), -sign * m(0, 2));
      joints[4] = std::atan2(sign * sine, m(2, 2));
      const double j6 = std::atan2(-sign * m(2, 1), sign * m(2, 0));
      for (const auto& [joint, value] : {std::pair{0, joints[0]}, {3, j4}, {5, j6}}) {
        const JointLimit& limit = limits_[static_cast<std::size_t>(joint)];
        if (!Turns(value, limit).empty()) continue;
        closed(flip, placement.up, placement.front,
               [&, joint = joint, value = value] { return no_turn_text(joint, value, limit); });
      }
      for (const double q1 : Turns(joints[0], limits_[0])) {
        for (const double q4 : Turns(j4, limits_[3])) {
          for (const double q6 : Turns(j6, limits_[5])) {
            joints[0] = q1;
            joints[3] = q4;
            joints[5] = q6;
            if (!within_limits(joints)) {
              closed(flip, placement.up, placement.front,
                     [&] { return "out of limits: " + limit_violation(joints); });
              continue;
            }
            found(InverseSolution{joints,
                                  {flip,
                                   placement.up,
                                   placement.front,
                                   {turn_number(q4), turn_number(joints[4]), turn_number(q6)}}});
          }
        }
      }
    }
  };
  place_wrist(wrist, turn_wrist, [&](bool front, bool up, const auto& text) {
    for (const bool flip : {false, true}) closed(flip, up, front, text);
  });
}

std::vector<InverseSolution> SphericalWristArm::inverse(const Pose& flange,
                                                        std::string* reason) const {
  std::vector<InverseSolution> solutions;
  solutions.reserve(32);
  solve(
      flange, [&](const InverseSolution& solution) { solutions.push_back(solution); },
      [](bool, bool, bool, const auto&) {});
  if (reason == nullptr) return solutions;
  reason->clear();
  if (!solutions.empty()) return solutions;
  // the branch nearest to a solution, in this order: singular, beyond a limit, out of reach
  const std::vector<Branch> all = branches(flange);
  for (const char* kind : {"singular", "out of limits", "unreachable"}) {
    for (const Branch& branch : all) {
      if (reason->empty() && branch.obstacle.starts_with(kind)) *reason = branch.obstacle;
    }
  }
  return solutions;
}

std::vector<SphericalWristArm::Branch> SphericalWristArm::branches(const Pose& flange) const {
  std::vector<Branch> all;
  for (const bool front : {true, false}) {
    for (const bool up : {true, false}) {
      for (const bool flip : {false, true}) all.push_back({{flip, up, front, {}}, {}, ""});
    }
  }
  const auto branch = [&](bool flip, bool up, bool front) -> Branch& {
    return all[(front ? 0U : 4U) + (up ? 0U : 2U) + (flip ? 1U : 0U)];
  };
  solve(
      flange,
      [&](const InverseSolution& solution) {
        const ArmConfiguration& c = solution.configuration;
        branch(c.flip, c.up, c.front).solutions.push_back(solution);
      },
      [&](bool flip, bool up, bool front, const auto& text) {
        Branch& closed = branch(flip, up, front);
        if (closed.obstacle.empty()) closed.obstacle = text();
      });
  for (Branch& one : all) {
    if (!one.solutions.empty()) one.obstacle.clear();
  }
  return all;
}

Matrix6d SphericalWristArm::jacobian(const Joints& joints) const {
  const std::array<Pose, 7> links = link_poses(joints);
  Matrix6d relative;  // by the DH angles
  for (std::size_t i = 0; i < 6; ++i) {
    const Vector3d axis = links[i].rotation * Vector3d::UnitZ();
    const auto column = static_cast<Eigen::Index>(i);
    relative.block<3, 1>(0, column) = axis.cross(links[6].position - links[i].position);
    relative.block<3, 1>(3, column) = axis;
  }
  // J2 turns two DH angles at once
  relative.col(1) += relative.col(2);
  return relative;
}

double SphericalWristArm::manipulability(const Joints& joints) const {
  Matrix6d scaled = jacobian(joints);
  scaled.topRows<3>() /= geometry_.a1 + geometry_.a2 + forearm_;
  return min_singular_value(scaled);
}

Joints SphericalWristArm::motor_joints(const Joints& joints) const {
  Joints motors = joints;
  motors[2] += joints[1];
  return motors;
}

bool SphericalWristArm::within_limits(const Joints& joints) const {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (!within(joints[i], limits_[i].low, limits_[i].high)) return false;
  }
  return within(joints[1] + joints[2], sum_low_, sum_high_);
}

std::string SphericalWristArm::limit_violation(const Joints& joints) const {
  const auto violation = [](std::string what, double value, double low, double high) {
    const bool above = !(value < low);
    what += " = " + fixed(degrees(value), 2) + " deg is " + (above ? "above" : "below");
    what += " its limit of " + fixed(degrees(above ? high : low), 2) + " deg";
    return what;
  };
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const JointLimit& limit = limits_[i];
    if (!within(joints[i], limit.low, limit.high)) {
      return violation("J" + std::to_string(i + 1), joints[i], limit.low, limit.high);
    }
  }
  const double sum = joints[1] + joints[2];
  if (!within(sum, sum_low_, sum_high_)) return violation("J2 + J3", sum, sum_low_, sum_high_);
  return "";
}

ArmConfiguration SphericalWristArm::configuration(const Joints& joints) const {
  const double wrist = joints[2] + forearm_angle_;
  const double radius =
      geometry_.a1 + geometry_.a2 * std::sin(joints[1]) + forearm_ * std::cos(wrist);
  // the elbow is up where the forearm turns forward and down from the upper arm's direction
  const double bend = std::sin(pi / 2 - joints[1] - wrist);
  return {joints[4] > 0,
          bend >= 0,
          radius >= 0,
          {turn_number(joints[3]), turn_number(joints[4]), turn_number(joints[5])}};
}

}  // namespace berth
