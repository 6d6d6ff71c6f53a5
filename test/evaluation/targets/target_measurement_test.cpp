// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/targets/target_measurement.h"

#include <cmath>

#include "common/core/random.h"
#include "drivers/simulated/true_target.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::targets;

namespace {

/// A body and a panel on a hinge along its edge, whose surfaces depart by so much over so much, m.
Target body_with_panel(double sigma = 0, double length = 0.1, double panel_sigma = 0,
                       double panel_length = 0.1) {
  Target target;
  target.mesh = make_box({1, 0.8, 0.9});
  const std::size_t body = target.mesh.triangles.size();
  target.mesh.append(make_box({1.4, 0.7, 0.02}), {{1.25, 0, 0.1}, Quaterniond::Identity()});
  target.parts[0].material = {0.2, 0};
  target.parts[0].surface_sigma = sigma;
  target.parts[0].correlation_length = length;
  TargetPart panel;
  panel.name = "panel";
  panel.material = {0.6, 0};
  panel.surface_sigma = panel_sigma;
  panel.correlation_length = panel_length;
  panel.joint = Joint{Vector3d::UnitY(), {0.55, 0, 0.1}, radians(-20), radians(20), 0};
  target.parts.push_back(panel);
  target.part_of.assign(target.mesh.triangles.size(), 0);
  std::fill(target.part_of.begin() + static_cast<std::ptrdiff_t>(body), target.part_of.end(), 1);
  return target;
}

MeasurementSettings settings() {
  MeasurementSettings settings;
  settings.beam.range_sigma_m = 0.004;
  settings.full_scale_range = 10 / std::sqrt(10.0);
  return settings;
}

/// Scans of the true target from around, as a LIDAR with a range bias returns them, and truth that
/// errs by so much in each view.
std::vector<TrueReturn> scans(const Target& truth, std::uint64_t seed, double bias = 0,
                              std::size_t run = 0) {
  const RayCaster caster(truth.mesh);
  Random random(seed, "scans");
  std::vector<TrueReturn> returns;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.diagonal() << 1e-6, 1e-6, 1e-6, 4e-8, 4e-8, 4e-8;
  for (int view = 0; view < 8; ++view) {
    const Quaterniond turn(Eigen::AngleAxisd(0.35 * std::sin(1.3 * view), Vector3d::UnitY()) *
                           Eigen::AngleAxisd(0.5 * std::cos(2.1 * view), Vector3d::UnitX()));
    const Pose pose{{0, 0, 4}, turn};
    Vector6d error;
    error << random.normal_vector(1e-3), random.normal_vector(2e-4);
    const Pose reported = perturbed(pose, error);
    const Pose sensor = pose.inverse();
    for (int i = 0; i < 5000; ++i) {
      TrueReturn seen;
      seen.direction = beam_direction(random.uniform(-0.2, 0.5), random.uniform(-0.16, 0.16));
      RayHit hit;
      const Vector3d ray = sensor.rotation * seen.direction;
      const bool outlier = random.uniform() < 0.01;
      const double noise = random.normal(0.004);
      const double stray = random.uniform(3, 5);
      if (!caster.cast({sensor.position, ray}, 20, hit)) continue;
      const double cosine = -hit.normal.dot(ray);
      seen.range = outlier ? stray : hit.range + noise + bias;
      seen.run = run;
      seen.power = truth.part(hit.triangle).material.reflectivity * cosine *
                   std::pow(settings().full_scale_range / hit.range, 2);
      seen.pose = reported;
      seen.covariance = covariance;
      returns.push_back(seen);
    }
  }
  return returns;
}

}  // namespace

TEST_CASE("a world's surfaces, reflectivities and joint angle are found") {
  const Target target = body_with_panel(0.006, 0.08, 0.003, 0.12);
  TargetDepartures departures;
  departures.surface = 1;
  departures.joints = radians(15);
  const TrueTarget truth = draw_true_target(target, departures, 4);
  REQUIRE(std::abs(truth.parts[1].angle) > radians(2));
  const auto found = measure_parts(target, scans(truth.target, 3), settings());
  REQUIRE(found.size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const TargetPart& part = target.parts[i];
    INFO(found[i].part << ": " << found[i].note << ", came out as " << truth.parts[i].rms << " m, "
                       << found[i].surface_sigma->value << " +- " << found[i].surface_sigma->sigma
                       << ", l " << found[i].correlation_length->value);
    REQUIRE(found[i].surface_sigma);
    CHECK(found[i].surface_sigma->value == Approx(truth.parts[i].rms).epsilon(0.25));
    CHECK(found[i].correlation_length->value == Approx(part.correlation_length).epsilon(0.25));
    CHECK(found[i].reflectivity->value == Approx(part.material.reflectivity).epsilon(0.25));
  }
  CHECK_FALSE(found[0].joint_angle);
  REQUIRE(found[1].joint_angle);
  CHECK(std::abs(found[1].joint_angle->value - truth.parts[1].angle) < radians(1));
}

TEST_CASE("a rigid surface is not taken for soft because of truth's error") {
  const Target target = body_with_panel(0.0003, 0.1, 0.0003, 0.1);
  TargetDepartures departures;
  departures.surface = 1;
  const auto found =
      measure_parts(target, scans(draw_true_target(target, departures, 5).target, 5), settings());
  for (const PartMeasurement& part : found) {
    REQUIRE(part.surface_sigma);
    CHECK(part.surface_sigma->value < 0.001);
  }
  CHECK(std::abs(found[1].joint_angle->value) < radians(0.2));
}

TEST_CASE("a run's range bias is not taken for a surface, nor for a joint's angle") {
  const Target target = body_with_panel(0.0003, 0.1, 0.0003, 0.1);
  TargetDepartures departures;
  departures.surface = 1;
  departures.joints = radians(15);
  const TrueTarget truth = draw_true_target(target, departures, 6);
  auto returns = scans(truth.target, 7, 0.005, 0);
  const auto others = scans(truth.target, 8, -0.003, 1);
  returns.insert(returns.end(), others.begin(), others.end());
  const auto found = measure_parts(target, returns, settings());
  for (const PartMeasurement& part : found) {
    REQUIRE(part.surface_sigma);
    CHECK(part.surface_sigma->value < 0.001);
    REQUIRE(part.reflectivity);
    CHECK(part.reflectivity->sigma > 0);
  }
  const double error = found[1].joint_angle->value - truth.parts[1].angle;
  CHECK(std::abs(error) < radians(0.2));
  CHECK(std::abs(error) < 4 * found[1].joint_angle->sigma);
}

TEST_CASE("a part that was not seen is reported as such") {
  const Target target = body_with_panel();
  const auto found = measure_parts(target, {}, settings());
  REQUIRE(found.size() == 2);
  CHECK_FALSE(found[0].surface_sigma);
  CHECK_THAT(found[1].note, Catch::Contains("too few returns"));
}

TEST_CASE("derivatives of a departure by truth's error, range and joint agree with differences") {
  const Joint joint{Vector3d(1, 2, -1).normalized(), {0.3, -0.2, 0.1}, -1, 1, 0};
  TrueReturn seen;
  seen.origin = {0.1, -0.05, 0.02};
  seen.direction = beam_direction(0.1, -0.2);
  seen.pose = pose_from_xyzwpr({100, -100, 5500, 10, 40, -12});
  const Vector3d normal = Vector3d(0.2, -0.3, -1).normalized();
  // A plane through a point 5.2 m along the beam.
  const auto hit_of = [&](const TrueReturn& s, const Vector3d& n, const Vector3d& corner) {
    const Pose sensor = s.pose.inverse();
    const Vector3d ray = sensor.rotation * s.direction;
    RayHit hit;
    hit.range = n.dot(corner - sensor * s.origin) / n.dot(ray);
    hit.normal = n.dot(ray) > 0 ? Vector3d(-n) : n;
    return hit;
  };
  const Pose sensor = seen.pose.inverse();
  const Vector3d corner = sensor * (seen.origin + 5.2 * seen.direction);
  seen.range = 5.21;
  const Departure at = departure_of(seen, hit_of(seen, normal, corner), &joint);
  constexpr double h = 1e-5;
  const auto value = [&](const TrueReturn& s, double angle) {
    const Eigen::AngleAxisd turn(angle, joint.axis);
    return departure_of(s, hit_of(s, turn * normal, joint.point + turn * (corner - joint.point)),
                        nullptr)
        .value;
  };
  for (int i = 0; i < 7; ++i) {
    const auto moved_by = [&](double step) {
      TrueReturn s = seen;
      Vector6d error = Vector6d::Zero();
      if (i < 6) error[i] = step;
      if (i == 6) s.range += step;
      s.pose = perturbed(s.pose, error);
      return value(s, 0);
    };
    CHECK(at.by_error[i] == Approx((moved_by(h) - moved_by(-h)) / (2 * h)).margin(1e-6));
  }
  // The departure is of the mesh where it stands: a part that is turned beyond it departs by as
  // much as the mesh would have to be turned.
  TrueReturn on = seen;
  on.range = 5.2;
  const Departure there = departure_of(on, hit_of(on, normal, corner), &joint);
  CHECK(there.by_angle == Approx(-(value(on, h) - value(on, -h)) / (2 * h)).margin(1e-6));
}
