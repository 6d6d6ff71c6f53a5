// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/target_surface.h"

#include <cmath>

#include "common/core/beam_model.h"
#include "common/core/random.h"
#include "evaluation/measure/criterion.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;
using made::mm;

namespace {

/// 10 s of flight with truth at 125 Hz, and a RUN_INFO that holds this symmetry.
RunRecord flown_with(const std::string& symmetry) {
  RunRecord record;
  for (int i = 0; i <= 1250; ++i) {
    const Utime t = i * 8 * millisecond;
    record.add(made::truth(made::start + t, made::flight(seconds(t))));
  }
  record.add(made::state({{"go", 0, 10}}));
  run_info_t info{};
  if (!symmetry.empty()) {
    attachment_t attachment{};
    attachment.name = symmetry_file;
    attachment.content = symmetry;
    info.attachments = {attachment};
    info.attachment_count = 1;
  }
  record.add(info);
  return record;
}

Measured measured_on_target(const RunRecord& record, const std::string& name, Statistic statistic,
                            const NearestPoint& nearest = {}) {
  return Measurer(record, nearest)
      .measure(*measurement_named(name), statistic, *record.phase("go"));
}

/// An estimate that is off by this much, of the pose that the motion makes of it.
pose_estimate_t estimate_off(int i, const Vector6d& error, const Pose& motion) {
  const Utime t = 250 * millisecond + i * 500 * millisecond;
  return made::estimate(made::start + t, perturbed(made::flight(seconds(t)), error) * motion);
}

/// A scan of the target at one time: rays over all of it, with range noise.
ScanPacket scan_of(const RayCaster& target, const Pose& pose, std::int64_t id, Utime utime,
                   double sigma_m) {
  ScanPacket packet{};
  packet.utime = utime;
  packet.session = made::session;
  packet.scan_id = id;
  Random random(static_cast<std::uint64_t>(id), "scan");
  const Pose sensor = pose.inverse();
  packet.resize(400);
  for (std::size_t i = 0; i < 400; ++i) {
    const auto azimuth = static_cast<float>(random.uniform(-0.3, 0.3));
    const auto elevation = static_cast<float>(random.uniform(-0.2, 0.2));
    RayHit hit;
    const Vector3d direction = beam_direction(azimuth, elevation);
    const bool met = target.cast({sensor.position, sensor.rotation * direction}, 100, hit);
    packet.azimuth_rad[i] = azimuth;
    packet.elevation_rad[i] = elevation;
    // What met nothing came back from a wall.
    packet.range_m[i] =
        static_cast<float>(met ? hit.range + random.normal(sigma_m) : 8 + random.uniform());
    packet.status[i] = ScanPacket::HIT;
  }
  return packet;
}

const char upside_down[] =
    "tolerance: 6 mm\nmotions:\n  - pose: [0, 200, 100, 180, 0, 0]\n";  // about an axis aside

}  // namespace

TEST_CASE("an estimate that shows the same target is as right as the one nearest to truth") {
  RunRecord plain = flown_with(upside_down);
  RunRecord turned = flown_with(upside_down);
  RunRecord unkept = flown_with("");
  const Pose motion = pose_from_xyzwpr({0, 200, 100, 180, 0, 0});
  Vector6d error;
  error << 3 * mm, -4 * mm, 0, 0.002, 0.01, -0.004;
  for (int i = 0; i < 20; ++i) {
    pose_estimate_t estimate = estimate_off(i, error, Pose{});
    Matrix6d covariance = Matrix6d::Map(estimate.covariance);
    covariance(0, 4) = covariance(4, 0) = 3e-6;
    Matrix6d::Map(estimate.covariance) = covariance;
    estimate.linear_velocity_m_s[2] = -0.02;
    estimate.angular_velocity_rad_s[2] = radians(1.0);
    plain.add(estimate);
    // The same pose and covariance of the same body, expressed at another point of it.
    pose_estimate_t other = estimate_off(i, error, motion);
    const Vector3d lever = Vector3d::Map(other.position_m) - Vector3d::Map(estimate.position_m);
    Matrix6d jacobian = Matrix6d::Identity();
    jacobian.topRightCorner<3, 3>() = -skew(lever);
    Matrix6d::Map(other.covariance) = jacobian * covariance * jacobian.transpose();
    const Vector3d angular = Vector3d::Map(estimate.angular_velocity_rad_s);
    Vector3d::Map(other.linear_velocity_m_s) =
        Vector3d::Map(estimate.linear_velocity_m_s) + angular.cross(lever);
    Vector3d::Map(other.angular_velocity_rad_s) = angular;
    turned.add(other);
    unkept.add(other);
  }
  for (const char* name :
       {"position_error", "attitude_error", "measured_position_error", "measured_attitude_error",
        "nees", "velocity_error", "x_error", "attitude_y_error"}) {
    INFO(name);
    const double as_it_is = measured_on_target(plain, name, Statistic::rms).value;
    CHECK(measured_on_target(turned, name, Statistic::rms).value == Approx(as_it_is).margin(1e-7));
  }
  CHECK(measured_on_target(plain, "position_error", Statistic::rms).value == Approx(5 * mm));
  // A run that keeps no symmetry is judged as it was.
  CHECK(degrees(measured_on_target(unkept, "attitude_error", Statistic::min).value) > 170);
}

TEST_CASE("an estimator that goes over to an equal pose makes no step") {
  RunRecord record = flown_with(upside_down);
  record.add([] {
    auto state = made::state({{"go", 0, 4}, {"pause", 4, 5}, {"go", 5, 10}});
    state.seq = 1;
    state.utime += second;
    return state;
  }());
  const Pose motion = pose_from_xyzwpr({0, 200, 100, 180, 0, 0});
  for (int i = 0; i < 20; ++i) {
    record.add(estimate_off(i, Vector6d::Zero(), i < 9 ? Pose{} : motion));
  }
  CHECK(measured_on_target(record, "position_step_error", Statistic::peak).value < 1e-6);
  CHECK(measured_on_target(record, "attitude_step_error", Statistic::peak).value < 1e-6);
}

TEST_CASE("an unreadable symmetry is reported and not used") {
  std::string why;
  const RunRecord record = flown_with("motions: all\n");
  CHECK(symmetry_of_run(*record.info(), &why).trivial());
  CHECK_THAT(why, Catch::Contains("symmetry.yaml in RUN_INFO"));
}

TEST_CASE("the residual is of the returns and the surface, whatever the estimator reports") {
  Target target;
  target.mesh = make_box({2, 1, 0.7});
  const NearestPoint surface = nearest_point_on(target);
  const auto record_with = [&](const Vector6d& error) {
    RunRecord record = flown_with("");
    for (int i = 0; i < 10; ++i) {
      pose_estimate_t estimate = estimate_off(i, error, Pose{});
      estimate.scan_id = i;
      estimate.residual_rms_m = 5 * mm;
      record.add(estimate);
      const double t = seconds(estimate.utime - made::start);
      record.add(scan_of(*surface.rays, made::flight(t), i, estimate.utime, 8 * mm));
    }
    return record;
  };
  const auto judged = [&](const RunRecord& record) {
    Config config = Config::parse(
        "criteria:\n  - {name: RMS, measurement: residual, statistic: peak, phase: go, max: 30 "
        "mm}\n",
        "test");
    return judge(read_criteria(config).at(0), Measurer(record, surface));
  };
  const RunRecord right = record_with(Vector6d::Zero());
  CHECK(measured_on_target(right, "residual", Statistic::rms, surface).value ==
        Approx(8 * mm).epsilon(0.1));
  CHECK(judged(right).result == criterion_result_t::PASSED);
  Vector6d off = Vector6d::Zero();
  off(2) = 0.1;
  CHECK(measured_on_target(record_with(off), "residual", Statistic::rms, surface).value ==
        Approx(100 * mm).epsilon(0.1));
  CHECK(judged(record_with(off)).result == criterion_result_t::FAILED);
  off(2) = 2;  // however far
  CHECK(measured_on_target(record_with(off), "residual", Statistic::rms, surface).value > 1);
  off << 0, 0, 0, 0, radians(20), 0;  // turned
  CHECK(judged(record_with(off)).result == criterion_result_t::FAILED);

  RunRecord blind = flown_with("");
  blind.add(estimate_off(0, Vector6d::Zero(), Pose{}));
  CHECK(judged(blind).result == criterion_result_t::INCONCLUSIVE);
  CHECK_FALSE(judged(blind).reason.empty());
  CHECK_FALSE(measured_on_target(right, "residual", Statistic::rms).reason.empty());
}

TEST_CASE("the residual of a stream's estimate is that of its own packets") {
  Target target;
  target.mesh = make_box({2, 1, 0.7});
  const NearestPoint surface = nearest_point_on(target);
  RunRecord record = flown_with("");
  for (int i = 0; i < 2; ++i) {
    pose_estimate_t estimate = estimate_off(i, Vector6d::Zero(), Pose{});
    estimate.scan_id = 1;
    estimate.first_packet = estimate.last_packet = i;
    record.add(estimate);
    const double t = seconds(estimate.utime - made::start);
    ScanPacket packet = scan_of(*surface.rays, made::flight(t), 1, estimate.utime, 0);
    packet.packet = i;
    if (i == 1) {
      for (float& range : packet.range_m) range += 0.05F;
    }
    record.add(packet);
  }
  const auto series =
      measurement_named("residual")->series(Measurer(record, surface), *record.phase("go"));
  REQUIRE(series.value.size() == 2);
  CHECK(series.value[0] < 1 * mm);
  CHECK(series.value[1] > 40 * mm);
}
