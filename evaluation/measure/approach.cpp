// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "common/core/nan.h"
#include "evaluation/measure/series.h"

namespace berth::evaluation {
namespace {

constexpr char no_port[] = "the target has no such docking port";

Series surface_range(const Measurer& measurer, const Phase& phase) {
  Series series;
  series.reason = "the target's surface is not at hand";
  if (!measurer.nearest()) return series;
  return truth_series(
      [&measurer](const TruthSample& truth) {
        const Vector3d lever = measurer.surface_lever(truth);
        const Vector3d point = lever + truth.pose.position;
        return length_of(point, point_covariance(truth.covariance, lever));
      },
      measurer, phase);
}

/// Where the docking interface truly was in the sensor frame: its distance from the sensor's origin
/// along the axes that count.
Series docking_series(const Measurer& measurer, const Phase& phase, const Vector3d& axes) {
  Series series;
  series.reason = no_port;
  const DockingPort* port = measurer.port(phase);
  if (port == nullptr) return series;
  const Vector3d interface = port->pose.position;
  const Matrix3d keep = axes.asDiagonal();
  return truth_series(
      [&](const TruthSample& truth) {
        const Vector3d lever = truth.pose.rotation * interface;
        return length_of(keep * (truth.pose.position + lever),
                         keep * point_covariance(truth.covariance, lever) * keep);
      },
      measurer, phase);
}

Series docking_range(const Measurer& measurer, const Phase& phase) {
  return docking_series(measurer, phase, Vector3d::Ones());
}

Series docking_offset(const Measurer& measurer, const Phase& phase) {
  return docking_series(measurer, phase, Vector3d(1, 1, 0));
}

/// Between the interface's axis, which should look at the sensor, and the boresight.
Uncertain axis_angle(const TruthSample& truth, const Pose& docking) {
  const Vector3d axis = truth.pose.rotation * docking.rotation * Vector3d::UnitZ();
  const Vector3d reference = -Vector3d::UnitZ();
  const Vector3d turn = reference.cross(axis);
  // Turning about the axis itself changes nothing.
  const Matrix3d across = Matrix3d::Identity() - axis * axis.transpose();
  const Matrix3d covariance = across * truth.covariance.bottomRightCorner<3, 3>() * across;
  return {std::atan2(turn.norm(), reference.dot(axis)), length_of(turn, covariance).truth_sigma};
}

Series docking_angle(const Measurer& measurer, const Phase& phase) {
  Series series;
  series.reason = no_port;
  const DockingPort* port = measurer.port(phase);
  if (port == nullptr) return series;
  return truth_series([&](const TruthSample& truth) { return axis_angle(truth, port->pose); },
                      measurer, phase);
}

/// The interface at the moment of the phase in which it was nearest to the sensor's origin.
struct Contact {
  const TruthSample* truth = nullptr;
  Vector3d lever = Vector3d::Zero();  ///< sensor frame
  double range = std::numeric_limits<double>::infinity();
};

Contact closest(const Measurer& measurer, const Phase& phase, const Pose& docking) {
  Contact contact;
  const TruthTrack& track = measurer.record().truth();
  for (const Phase::Stretch& stretch : phase.stretches) {
    for (const TruthSample& sample : track.between(stretch.start, stretch.end)) {
      const Vector3d lever = sample.pose.rotation * docking.position;
      const double range = (sample.pose.position + lever).norm();
      if (range < contact.range) contact = {&sample, lever, range};
    }
  }
  return contact;
}

using OfContact = Uncertain (*)(const Contact&, const Pose& docking);

template <OfContact value>
Measured at_contact(const Measurer& measurer, const Phase& phase) {
  const DockingPort* port = measurer.port(phase);
  if (port == nullptr) return {nan, 0, 0, no_port};
  const Contact contact = closest(measurer, phase, port->pose);
  if (contact.truth == nullptr) return {nan, 0, 0, "there is no ground truth"};
  const Uncertain v = value(contact, port->pose);
  return {v.value, v.truth_sigma, 1, ""};
}

Uncertain contact_range(const Contact& c, const Pose&) {
  return length_of(c.truth->pose.position + c.lever,
                   point_covariance(c.truth->covariance, c.lever));
}

Uncertain contact_offset(const Contact& c, const Pose&) {
  const Matrix3d across = Vector3d(1, 1, 0).asDiagonal();
  return length_of(across * (c.truth->pose.position + c.lever),
                   across * point_covariance(c.truth->covariance, c.lever) * across);
}

Uncertain contact_angle(const Contact& c, const Pose& docking) {
  return axis_angle(*c.truth, docking);
}

}  // namespace

void add_approach(std::vector<Measurement>& table) {
  using enum Direction;
  Family family("approach and contact", table);
  const auto length = berth::Dimension::length;
  family.series("surface_range", length, neither, surface_range,
                "true distance from the sensor to the nearest surface of the target");
  family.series("docking_range", length, neither, docking_range,
                "true distance from the sensor to the docking interface");
  family.series("docking_offset", length, smaller_is_better, docking_offset,
                "true distance of the docking interface from the boresight");
  family.series("docking_angle", berth::Dimension::angle, smaller_is_better, docking_angle,
                "true angle between the docking interface's axis and the boresight");
  family.number("contact_range", length, neither, at_contact<contact_range>,
                "true distance of the docking interface at closest approach");
  family.number("contact_offset", length, smaller_is_better, at_contact<contact_offset>,
                "miss distance: of the interface from the boresight at closest approach");
  family.number("contact_angle", berth::Dimension::angle, smaller_is_better,
                at_contact<contact_angle>,
                "between the interface's axis and the boresight at closest approach");
}

}  // namespace berth::evaluation
