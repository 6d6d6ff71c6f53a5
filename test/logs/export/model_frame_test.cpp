// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>

#include "common/core/beam_model.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/random.h"
#include "common/core/ray_caster.h"
#include "common/targets/target.h"
#include "evaluation/run/truth_track.h"
#include "logs/export/cloud_files.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/evaluation/measure/made_run.h"
#include "test/logs/file/made_log.h"

using namespace berth;
using namespace berth::logs;
using berth::evaluation::PoseSource;
using berth::evaluation::TargetPoses;

namespace {

constexpr double range_sigma = 0.005;  // m
constexpr double turn_rate = radians(3);
constexpr int scans = 20;
constexpr int beams = 600;
constexpr Utime beam_period = 500;     // us: a scan takes 0.3 s
constexpr Utime scan_period = second;  // the target turns by 3 degrees between two

/// Around the target at 5 m. T_sensor_model
Pose around(Utime utime) {
  const double angle = turn_rate * seconds(utime - made::start);
  return {Vector3d(0, 0, 5), rotation_from_vector({0, angle, 0})};
}

ScanPacket scan(int number, const RayCaster& target, Random& random) {
  ScanPacket packet{};
  packet.utime = made::start + number * scan_period + second / 2;
  packet.session = made::session;
  packet.scan_id = number + 1;
  packet.scan_status = ScanPacket::COMPLETE;
  packet.resize(beams);
  for (std::size_t i = 0; i < beams; ++i) {
    packet.time_us[i] = static_cast<std::int32_t>(static_cast<Utime>(i) * beam_period);
    packet.azimuth_rad[i] = static_cast<float>(random.uniform(-0.3, 0.3));
    packet.elevation_rad[i] = static_cast<float>(random.uniform(-0.3, 0.3));
    const Pose to_model = around(packet.utime + packet.time_us[i]).inverse();
    RayHit hit;
    packet.status[i] = ScanPacket::MISS;
    if (!target.cast({to_model.position, to_model.rotation * packet.direction(i)}, 100, hit)) {
      continue;
    }
    packet.status[i] = ScanPacket::HIT;
    packet.range_m[i] = static_cast<float>(hit.range + range_sigma * random.normal());
  }
  return packet;
}

/// A fly-around with truth at 125 Hz and an estimate of every scan but the last, each 2 mm off.
void write_fly_around(const std::filesystem::path& file, const RayCaster& target) {
  LogWriter writer(file);
  for (Utime t = made::start; t < made::start + (scans + 1) * scan_period; t += 8 * millisecond) {
    write_message(writer, t, "GROUND_TRUTH", made::truth(t, around(t)));
  }
  Random random(1, "returns");
  for (int number = 0; number < scans; ++number) {
    const ScanPacket packet = scan(number, target, random);
    write_message(writer, packet.utime, "SCAN_DATA", packet);
    if (number == scans - 1) continue;
    const Utime mean = packet.utime + beams / 2 * beam_period;
    Pose pose = around(mean);
    pose.position.x() += 0.002;
    pose_estimate_t estimate = made::estimate(mean, pose);
    estimate.scan_id = packet.scan_id;
    estimate.angular_velocity_rad_s[1] = turn_rate;
    write_message(writer, mean, "POSE_ESTIMATE", estimate);
  }
}

std::vector<Vector3d> points_of(const std::filesystem::path& pcd) {
  const std::string bytes = read_file(pcd);
  const std::string end = "DATA binary\n";
  std::vector<Vector3d> points;
  for (std::size_t at = bytes.find(end) + end.size(); at < bytes.size(); at += 36) {
    Eigen::Vector3f point;
    std::memcpy(point.data(), bytes.data() + at, 12);
    points.push_back(point.cast<double>());
  }
  return points;
}

double rms_distance(const std::vector<Vector3d>& points, const RayCaster& target) {
  double squares = 0;
  for (const Vector3d& point : points) squares += (target.nearest(point) - point).squaredNorm();
  return std::sqrt(squares / static_cast<double>(points.size()));
}

CloudExport export_merged(const std::filesystem::path& log, const std::filesystem::path& out,
                          PoseSource by) {
  CloudOptions options;
  options.merge = true;
  options.model_pose = [poses = TargetPoses(log, by)](const ScanCloud& cloud, Utime utime) {
    return poses.at(cloud.session, cloud.scan_id, utime);
  };
  return export_clouds(log, out, options);
}

}  // namespace

TEST_CASE("scans of a fly-around, merged in the model's frame, lie on the mesh") {
  const RayCaster target(load_target("radarsat2", 0).mesh);
  TemporaryFile log;
  TemporaryDirectory out;
  write_fly_around(log.path, target);

  const CloudExport by_truth = export_merged(log.path, out / "truth", PoseSource::truth);
  CHECK(by_truth.scans == scans);
  CHECK(by_truth.without_pose == 0);
  const auto points = points_of(out / "truth" / "session_7_merged.pcd");
  REQUIRE(std::ssize(points) == by_truth.points);
  REQUIRE(points.size() > 1000);
  CHECK(rms_distance(points, target) < range_sigma);
  for (const Vector3d& point : points) {
    CHECK((target.nearest(point) - point).norm() < 5 * range_sigma);
  }

  const CloudExport by_estimate = export_merged(log.path, out / "estimate", PoseSource::estimate);
  CHECK(by_estimate.scans == scans - 1);  // the last one has no estimate
  CHECK(by_estimate.without_pose > 20);
  CHECK(by_estimate.points + by_estimate.without_pose == by_truth.points);
  const auto estimated = points_of(out / "estimate" / "session_7_merged.pcd");
  CHECK(rms_distance(estimated, target) < std::hypot(range_sigma, 0.002));

  // The same scans in the sensor's frame lie anywhere.
  CloudOptions apart;
  CHECK(export_clouds(log.path, out / "sensor", apart).scans == scans);
  CHECK(rms_distance(points_of(out / "sensor" / "session_7_scan_000001.pcd"), target) > 1);
}

TEST_CASE("nothing is placed where truth has a hole") {
  TemporaryFile log;
  {
    LogWriter writer(log.path);
    for (const Utime ms : {0, 8, 500, 508}) {
      const Utime t = made::start + ms * millisecond;
      write_message(writer, t, "GROUND_TRUTH", made::truth(t, around(t)));
    }
  }
  const TargetPoses poses(log.path, PoseSource::truth);
  CHECK(poses.at(made::session, 1, made::start + 4 * millisecond));
  CHECK_FALSE(poses.at(made::session, 1, made::start + 250 * millisecond));
  CHECK_FALSE(poses.at(made::session, 1, made::start - 1));
  CHECK_FALSE(poses.at(made::session + 1, 1, made::start + 4 * millisecond));
}
