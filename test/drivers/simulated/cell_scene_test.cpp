// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/cell_scene.h"

#include <array>
#include <cmath>

#include "test/catch.h"

using namespace berth;

namespace {

/// Joints 1 to 3 shift the flange, joint 4 turns it about y; two bodies, on the base and on the
/// last link.
class Slide final : public ArmKinematics {
 public:
  Slide() {
    Mesh block;
    block.append(make_box({0.2, 0.2, 0.2}), {{0, 0.5, -0.5}, Quaterniond::Identity()});
    bodies_ = {{"base", 0, block}, {"hand", 6, make_box({0.1, 0.1, 0.1})}};
  }
  Pose forward(const Joints& j) const override {
    return {{j[0], j[1], j[2]}, rotation_from_vector(Vector3d(0, j[3], 0))};
  }
  std::array<Pose, 7> link_poses(const Joints& j) const override {
    std::array<Pose, 7> poses;
    poses[6] = forward(j);
    return poses;
  }
  std::vector<InverseSolution> inverse(const Pose&, std::string*) const override { return {}; }
  double manipulability(const Joints&) const override { return 1; }
  Matrix6d jacobian(const Joints&) const override { return Matrix6d::Identity(); }
  std::string limit_violation(const Joints&) const override { return ""; }
};

/// Sensor at the cell's origin looking along its z; a plate 1 m square 5 m before it, held from
/// behind by a rod and a slide; a wall 9 m away.
Cell small_cell() {
  Cell cell;
  cell.sensor.role = ArmRole::sensor;
  cell.sensor.kinematics = std::make_shared<Slide>();
  cell.replica.kinematics = std::make_shared<Slide>();
  cell.replica.base.position = {0, 0, 6};
  cell.replica.tool.position = {0, 0, -1};
  cell.target.mesh = make_box({1, 1, 0.01});
  cell.mount.append(make_box({0.1, 0.1, 0.9}), {{0, 0, -0.5}, Quaterniond::Identity()});
  cell.sensor_housing = make_box({1, 1, 1});
  cell.room.push_back({"wall", {}, false});
  cell.room[0].mesh.append(make_box({4, 4, 0.02}), {{0, 0, 9.01}, Quaterniond::Identity()});
  cell.room.push_back({"do not enter", {}, true});
  cell.room[1].mesh.append(make_box({4, 4, 0.02}), {{0, 0, 3}, Quaterniond::Identity()});
  return cell;
}

Vector3d towards(double x, double y, double z) { return Vector3d(x, y, z).normalized(); }

}  // namespace

TEST_CASE("the scene shows target, mount, arms and room, each with its distance") {
  const auto still = [](Utime) { return Joints{}; };
  SceneSettings settings;
  settings.mount.reflectivity = 0.2;
  settings.arm.reflectivity = 0.3;
  settings.room.reflectivity = 0.4;
  Cell cell = small_cell();
  cell.target.parts.front().material.reflectivity = 0.1;
  CellScene scene(cell, still, still, settings);
  SceneHit hit;

  // Straight ahead: no housing, no keep-out volume, not the hand that holds the sensor.
  REQUIRE(scene.cast(0, Vector3d::UnitZ(), 100, hit));
  CHECK(hit.target);
  CHECK(hit.range == Approx(4.995).epsilon(1e-9));
  CHECK(hit.cosine == Approx(1));
  CHECK(hit.material.reflectivity == 0.1);

  REQUIRE(scene.cast(0, towards(0.3, 0.2, 4.995), 100, hit));
  CHECK(hit.range == Approx(Vector3d(0.3, 0.2, 4.995).norm()).epsilon(1e-9));
  CHECK(hit.cosine == Approx(4.995 / hit.range).epsilon(1e-9));

  // Past the plate: the base of the replica's slide, 5.4 m away and half a metre down.
  REQUIRE(scene.cast(0, towards(0.0, 0.59, 5.4), 100, hit));
  CHECK_FALSE(hit.target);
  CHECK(hit.material.reflectivity == 0.3);
  CHECK(hit.range == Approx(Vector3d(0, 0.59, 5.4).norm()).epsilon(1e-9));

  // Past everything: the wall, or nothing.
  REQUIRE(scene.cast(0, towards(1, 1, 9), 100, hit));
  CHECK(hit.material.reflectivity == 0.4);
  CHECK(hit.range == Approx(std::sqrt(83.0)).epsilon(1e-9));
  CHECK_FALSE(scene.cast(0, towards(1, 1, 9), 9, hit));
  CHECK_FALSE(scene.cast(0, Vector3d::UnitX(), 100, hit));
}

TEST_CASE("the mount is seen next to a target that does not hide it") {
  const auto still = [](Utime) { return Joints{}; };
  Cell cell = small_cell();
  cell.target.mesh = make_box({0.01, 0.01, 0.01});
  CellScene scene(cell, still, still);
  SceneHit hit;
  REQUIRE(scene.cast(0, towards(0.03, 0, 5.05), 100, hit));
  CHECK_FALSE(hit.target);
  CHECK(hit.range == Approx(Vector3d(0.03, 0, 5.05).norm()).epsilon(1e-9));
}

TEST_CASE("both arms are where they are when the beam leaves") {
  // The replica recedes at 1 m/s, the sensor follows at 0.25 m/s and turns.
  const auto replica = [](Utime t) { return Joints{0, 0, seconds(t), 0, 0, 0}; };
  const auto sensor = [](Utime t) {
    return Joints{0, 0, 0.25 * seconds(t), 0.1 * seconds(t), 0, 0};
  };
  CellScene scene(small_cell(), replica, sensor);
  for (const Utime t : {Utime{0}, 10 * millisecond, 500 * millisecond, 1 * second}) {
    const Pose truth = scene.relative_pose(t);
    CHECK((truth.position - rotation_from_vector(Vector3d(0, -0.1 * seconds(t), 0)) *
                                Vector3d(0, 0, 5 + 0.75 * seconds(t)))
              .norm() < 1e-12);
    SceneHit hit;
    // At the middle of the plate's front.
    const Vector3d aim = truth * Vector3d(0, 0, -0.005);
    REQUIRE(scene.cast(t, aim.normalized(), 100, hit));
    CHECK(hit.target);
    CHECK(hit.range == Approx(aim.norm()).epsilon(1e-9));
  }
}

TEST_CASE(
    "in every layout shipped the sensor sees the target from home, and room where there is one") {
  for (const char* layout : {"range", "contact", "free"}) {
    INFO(layout);
    const Cell cell =
        load_cell(std::string("config/layouts/") + layout + ".yaml", load_target("radarsat2", 0));
    CellScene scene(
        cell, [&](Utime) { return cell.replica.home; }, [&](Utime) { return cell.sensor.home; });
    const Pose truth = scene.relative_pose(0);
    CHECK(distance(truth, cell.relative_pose(cell.replica.home, cell.sensor.home)) < 1e-12);
    SceneHit hit;
    REQUIRE(scene.cast(0, truth.position.normalized(), 100, hit));
    CHECK(hit.target);
    CHECK(hit.range > 2);
    CHECK(hit.range < truth.position.norm());
    // Far from the target: walls or nothing, never something before the aperture.
    const Vector3d aside = Vector3d(0.3, -0.3, 1).normalized();
    const bool met = scene.cast(0, aside, 100, hit);
    CHECK(met == !cell.room.empty());
    if (met) CHECK(hit.range > 1);
  }
}

TEST_CASE("the sun lamp stands in a direction of the cell, and the target can hide it") {
  const auto still = [](Utime) { return Joints{}; };
  // The sensor looks along the cell's z.
  CellScene scene(small_cell(), still, still);
  CHECK(scene.sunlight(0).level == 0);
  SunLamp lamp{0.5, 0, radians(90)};
  scene.set_sun_lamp([&] { return lamp; });
  const Sunlight ahead = scene.sunlight(0);
  CHECK(ahead.level == 0.5);
  CHECK((ahead.towards - Vector3d::UnitZ()).norm() < 1e-12);
  CHECK_FALSE(ahead.in_view);
  lamp.elevation = radians(80);  // past the plate, 0.5 m at 5 m; the room's wall hides nothing
  CHECK(scene.sunlight(0).in_view);
  CHECK((scene.sunlight(0).towards - towards(std::tan(radians(10)), 0, 1)).norm() < 1e-12);
  lamp.azimuth = radians(90);
  CHECK((scene.sunlight(0).towards - towards(0, std::tan(radians(10)), 1)).norm() < 1e-12);
  lamp.elevation = radians(-30);  // behind the aperture
  CHECK_FALSE(scene.sunlight(0).in_view);
}

TEST_CASE("normals come in the sensor's frame") {
  const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  CellScene scene(
      cell, [&](Utime) { return cell.replica.home; }, [&](Utime) { return cell.sensor.home; });
  SceneHit hit;
  for (const double x : {-0.2, -0.1, 0.0, 0.1, 0.2}) {
    const Vector3d beam = towards(x, 0.02, 1);
    REQUIRE(scene.cast(0, beam, 100, hit));
    CHECK(hit.normal.norm() == Approx(1));
    CHECK(hit.cosine == Approx(-hit.normal.dot(beam)));
  }
  REQUIRE(scene.cast(0, towards(0, 0, 1), 100, hit));
  CHECK(hit.target);
  CHECK((hit.normal + Vector3d::UnitZ()).norm() < 1e-3);  // at home its front faces the sensor
}

TEST_CASE("a plate hides the requested share of the target") {
  const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  CellScene scene(
      cell, [&](Utime) { return cell.replica.home; }, [&](Utime) { return cell.sensor.home; });
  const auto on_target = [&](double share) {
    scene.set_occlusion(share);
    int hits = 0;
    for (int i = -100; i <= 100; ++i) {
      SceneHit hit;
      hits += scene.cast(0, towards(0.003 * i, 0.01, 1), 100, hit) && hit.target ? 1 : 0;
    }
    return hits;
  };
  const int all = on_target(0);
  CHECK(all > 80);
  CHECK(on_target(0.5) == Approx(all / 2.0).margin(0.1 * all));
  CHECK(on_target(0.25) > on_target(0.5));
  CHECK(on_target(0.75) < on_target(0.5));
  CHECK(on_target(1) == 0);
  CHECK(on_target(0) == all);
}

TEST_CASE("rays of one beam meet what each would meet alone; motion between is interpolated") {
  const Cell cell = load_cell("config/layouts/range.yaml", load_target("radarsat2", 0));
  // Both arms at 20 deg/s and more.
  const auto moving = [](const Joints& home, double sign) {
    return [home, sign](Utime t) {
      Joints joints = home;
      for (std::size_t i = 0; i < joints.size(); ++i) {
        joints[i] += sign * radians(20 + 5.0 * static_cast<double>(i)) * seconds(t);
      }
      return joints;
    };
  };
  CellScene exact(cell, moving(cell.replica.home, 1), moving(cell.sensor.home, -1));
  CellScene scene(cell, moving(cell.replica.home, 1), moving(cell.sensor.home, -1));
  int edges = 0;
  for (int packet = 0; packet < 8; ++packet) {
    const Utime start = packet * 25 * millisecond;
    scene.prepare(start + 24500);
    for (int i = 0; i < 50; ++i) {
      const Utime t = start + i * 500;
      const double across = 0.3 * std::sin(0.7 * i + packet);
      std::array<Ray, 8> rays;
      for (std::size_t r = 0; r < rays.size(); ++r) {
        const double angle = 0.9 * static_cast<double>(r);
        const Vector3d aside(std::cos(angle), std::sin(angle), 0);
        rays[r].origin = (r == 0 ? 0.0 : 0.006) * aside;
        rays[r].direction = towards(across + 1e-4 * std::cos(angle), 0.05 * std::cos(i), 1);
      }
      std::array<SceneHit, 8> together;
      scene.cast(t, rays, 100, together);
      for (std::size_t r = 0; r < rays.size(); ++r) {
        SceneHit alone;
        exact.cast(t, {&rays[r], 1}, 100, {&alone, 1});
        REQUIRE(together[r].met() == alone.met());
        if (!alone.met() || alone.cosine < 0.3) continue;
        // Where a ray just misses an edge in one of the two it meets something else.
        if (std::abs(together[r].range - alone.range) > 0.01 ||
            together[r].normal.dot(alone.normal) < 0.999) {
          ++edges;
          continue;
        }
        CHECK(together[r].range == Approx(alone.range).margin(200e-6));
      }
    }
  }
  CHECK(edges < 30);
}
