// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/guidance/approach_axis.h"

namespace berth::testbed {

ApproachAxis::ApproachAxis(const ApproachTarget& target, GuidanceProfile::Align align, bool dock,
                           const Pose& sensor, const Pose& model)
    : target_(target), align_(align), dock_(dock) {
  if (dock_ || turning()) aim_ = target_.port->pose.position;
  if (turning()) {
    axis_ = target_.port->pose.rotation * Vector3d::UnitZ();
    attitude_ = target_.port->pose.rotation * Quaterniond(0, 1, 0, 0);  // z inwards
    return;
  }
  axis_ = (sensor.position - model * aim_).normalized();
  const Vector3d boresight = sensor.rotation * Vector3d::UnitZ();
  attitude_ = (Quaterniond::FromTwoVectors(boresight, -axis_) * sensor.rotation).normalized();
}

double ApproachAxis::keep(const Pose& sensor, const Pose& model) {
  const Quaterniond to_frame = turning() ? model.rotation.conjugate() : Quaterniond::Identity();
  const Vector3d offset = to_frame * (sensor.position - model * aim_);
  axis_ = offset.normalized();
  attitude_ = (to_frame * sensor.rotation).normalized();
  return offset.norm();
}

Vector3d ApproachAxis::direction(const Pose& model) const {
  return turning() ? Vector3d(model.rotation * axis_) : axis_;
}

ApproachAxis::Reference ApproachAxis::reference(const Pose& model, const Velocity& moving,
                                                double along, double speed,
                                                double acceleration) const {
  const Vector3d out = direction(model);
  const Vector3d lever = model.rotation * aim_;
  Reference reference;
  reference.pose.position = model.position + lever + along * out;
  reference.pose.rotation = attitude_;
  reference.velocity.linear = moving.linear + moving.angular.cross(lever) + speed * out;
  reference.acceleration = acceleration * out + moving.angular.cross(moving.angular.cross(lever));
  if (turning()) {
    const Vector3d& w = moving.angular;
    reference.pose.rotation = (model.rotation * attitude_).normalized();
    reference.velocity.linear += along * w.cross(out);
    reference.velocity.angular = w;
    reference.acceleration += 2 * speed * w.cross(out) + along * w.cross(w.cross(out));
  }
  return reference;
}

ApproachAxis::Place ApproachAxis::place(const Pose& sensor, const Pose& model) const {
  const Vector3d away = sensor.position - model * aim_;
  const Vector3d out = direction(model);
  Place place;
  place.along = out.dot(away);
  place.offset = (away - place.along * out).norm();
  if (dock_ || target_.surface == nullptr) {
    place.range = away.norm();
  } else {
    const Vector3d eye = model.inverse() * sensor.position;
    place.range = (target_.surface->nearest(eye) - eye).norm();
  }
  return place;
}

}  // namespace berth::testbed
