// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/voxel_template_acquisition.h"

#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

const BeamModel beam_model;
const VoxelTemplateOptions voxel_options;

bool is_right(const Pose& pose, const Pose& truth) {
  return angle_between(pose, truth) < radians(5) && distance(pose, truth) < 0.15;
}

struct Tally {
  int right = 0;
  int ambiguous_with_truth = 0;
  int silent_error = 0;
  int not_found = 0;
};

/// A cell behind the target: an arm that holds it, and a wall.
void add_cell(ScanMaker& lidar, double distance) {
  Mesh arm;
  arm.append(make_cylinder(0.12, 1.5, 12), {{0.1, 0.05, distance + 1.2}, Quaterniond::Identity()});
  arm.append(make_box({0.5, 0.6, 0.5}), {{0.1, 0.3, distance + 1.9}, Quaterniond::Identity()});
  lidar.add_clutter(arm);
  Mesh wall;
  wall.append(make_box({20, 20, 0.1}), {{0, 0, distance + 4}, Quaterniond::Identity()});
  lidar.add_clutter(wall);
}

Tally acquire_random_attitudes(int trials, int beams, bool zoomed, bool cell) {
  const auto model = replica_model();
  const VoxelTemplateAcquisition acquisition(*model, beam_model, voxel_options);
  const double distance = 5.5;
  Random random(11, "attitudes");
  Tally tally;
  for (int i = 0; i < trials; ++i) {
    ScanMaker lidar(model->target.mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.pose = random_pose(random, distance);
    if (cell) add_cell(lidar, distance);
    const Pose truth = lidar.pose;
    const auto raw = lidar.sweep(zoomed ? around(*model, truth, beams) : full_view(beams));
    const AcquisitionResult result =
        acquisition.acquire(preprocess(raw, {1, distance + 3}, beam_model));
    if (result.status == AcquisitionResult::Status::found) {
      CHECK(result.reason.empty());
      ++(is_right(result.hypotheses.front().pose, truth) ? tally.right : tally.silent_error);
      continue;
    }
    CHECK_FALSE(result.reason.empty());
    const bool has_truth =
        std::any_of(result.hypotheses.begin(), result.hypotheses.end(),
                    [&](const Hypothesis& h) { return is_right(h.pose, truth); });
    const bool ambiguous = result.status == AcquisitionResult::Status::ambiguous;
    ++(ambiguous && has_truth ? tally.ambiguous_with_truth : tally.not_found);
  }
  return tally;
}

}  // namespace

TEST_CASE("The replica is acquired from the whole field of view at random attitudes") {
  const Tally tally = acquire_random_attitudes(60, 6000, false, false);
  CAPTURE(tally.right, tally.ambiguous_with_truth, tally.not_found);
  CHECK(tally.silent_error == 0);
  CHECK(tally.right >= 57);
}

TEST_CASE("The replica is acquired before an arm and a wall") {
  const Tally tally = acquire_random_attitudes(40, 6000, false, true);
  CAPTURE(tally.right, tally.ambiguous_with_truth, tally.not_found);
  CHECK(tally.silent_error == 0);
  CHECK(tally.right >= 37);
}

TEST_CASE("A window around the replica is enough") {
  const Tally tally = acquire_random_attitudes(40, 3000, true, true);
  CAPTURE(tally.right, tally.ambiguous_with_truth, tally.not_found);
  CHECK(tally.silent_error == 0);
  CHECK(tally.right >= 37);
}

TEST_CASE("With few returns there may be ambiguity, but no silent error") {
  const Tally tally = acquire_random_attitudes(40, 1200, false, false);
  CAPTURE(tally.right, tally.ambiguous_with_truth, tally.not_found);
  CHECK(tally.silent_error == 0);
  CHECK(tally.right >= 20);
}

TEST_CASE("A target without a long axis is refused with the reason") {
  const auto cube = cube_model();
  const VoxelTemplateAcquisition acquisition(*cube, beam_model, voxel_options);
  ScanMaker lidar(cube->target.mesh);
  const AcquisitionResult result =
      acquisition.acquire(preprocess(lidar.sweep(full_view(4000)), {}, beam_model));
  CHECK(result.status == AcquisitionResult::Status::refused);
  CHECK_THAT(result.reason, Catch::Contains("not elongated"));
  CHECK(result.hypotheses.empty());
}

TEST_CASE("Something else is not taken for the replica") {
  const auto model = replica_model();
  const VoxelTemplateAcquisition acquisition(*model, beam_model, voxel_options);
  Random random(3, "others");
  const Mesh others[] = {make_box({3, 1.2, 0.6}), make_cylinder(0.5, 3, 24), make_box({1, 1, 1}),
                         make_box({8, 8, 0.1})};
  for (const Mesh& other : others) {
    for (int i = 0; i < 5; ++i) {
      ScanMaker lidar(other);
      lidar.pose = random_pose(random, 6);
      const AcquisitionResult result =
          acquisition.acquire(preprocess(lidar.sweep(full_view(5000)), {}, beam_model));
      CHECK(result.status != AcquisitionResult::Status::found);
    }
  }
}

TEST_CASE("Two equal poses of a symmetric target are one: the one turned less") {
  Target bar;
  bar.name = "bar";
  bar.mesh = make_box({3, 0.5, 0.3});
  bar.hash = content_hash(bar.mesh);
  ModelOptions coarse;
  coarse.surface_samples = 6000;
  coarse.grid_voxels = 100000;
  const auto model = compile_target_model(bar, coarse);
  const VoxelTemplateAcquisition acquisition(*model, beam_model, voxel_options);
  ScanMaker lidar(bar.mesh);
  lidar.pose = pose_from_xyzwpr({0, 0, 5000, 150, 20, 160});
  const AcquisitionResult result =
      acquisition.acquire(preprocess(lidar.sweep(full_view(6000)), {}, beam_model));
  REQUIRE(result.status == AcquisitionResult::Status::found);
  const Pose& pose = result.hypotheses.front().pose;
  CHECK(result.hypotheses.front().equal_poses > 1);
  // a half turn about an axis of the box carries the found pose into the true one
  const Quaterniond rest = pose.rotation.conjugate() * lidar.pose.rotation;
  const double turn = angle_between({}, {Vector3d::Zero(), rest});
  CHECK((turn < radians(3) || std::abs(turn - radians(180)) < radians(3)));
  CHECK(distance(pose, lidar.pose) < 0.05);
  CHECK(angle_between({}, pose) <= angle_between({}, lidar.pose) + radians(3));
}

TEST_CASE("Scans with nothing in them are not found, each with a reason") {
  const auto model = replica_model();
  const VoxelTemplateAcquisition acquisition(*model, beam_model, voxel_options);
  std::vector<RawBeam> misses(3000);
  for (std::size_t i = 0; i < misses.size(); ++i) {
    misses[i].azimuth = 1e-4 * static_cast<double>(i);
  }
  std::vector<RawBeam> one = misses;
  one[7].status = BeamStatus::hit;
  one[7].range = 5;
  std::vector<RawBeam> same(3000, one[7]);
  for (const auto& raw : {std::vector<RawBeam>{}, misses, one, same}) {
    const AcquisitionResult result = acquisition.acquire(preprocess(raw, {}, beam_model));
    CHECK(result.status == AcquisitionResult::Status::not_found);
    CHECK_FALSE(result.reason.empty());
  }
}
