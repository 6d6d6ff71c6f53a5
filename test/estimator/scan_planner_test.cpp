// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/plan/scan_planner.h"

#include <Eigen/LU>

#include "estimator/plan/pose_information.h"
#include "test/catch.h"
#include "test/estimator/planned_windows.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

TEST_CASE("Every strategy brings the returns asked for, from windows inside the field of view") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, {}, planner_options);
  const int strategy = GENERATE(range(0, 6));
  const double range = GENERATE(3.6, 5.5, 20.0, 100.0);
  const Pose pose = pose_from_xyzwpr({100, -100, 1e3 * range, 25, 20, -30});
  const auto windows = planner.plan(pose, 0.01, static_cast<ScanStrategy>(strategy), 1000);
  REQUIRE_FALSE(windows.empty());
  check_in_view(windows);
  const bool dense = static_cast<ScanStrategy>(strategy) == ScanStrategy::dense;
  ScanMaker lidar(model->target.mesh);
  lidar.pose = pose;
  int hits = 0;
  for (const Window& w : windows) {
    for (const RawBeam& beam : lidar.sweep(w)) hits += beam.status == BeamStatus::hit ? 1 : 0;
  }
  const int wanted = dense ? 10000 : 1000;
  CHECK(hits <= 1.3 * wanted);
  // A thin target far away leaves most of its windows empty: not more than ten times the beams.
  if (beams_of(windows) < 9.9 * wanted) CHECK(hits >= 0.9 * wanted);
}

TEST_CASE("Windows are put on regions of the strategy that can be seen") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, {}, planner_options);
  Random random(1, "planner");
  for (int i = 0; i < 20; ++i) {
    const Pose pose = random_pose(random, 6);
    const auto windows = planner.plan(pose, 0.005, ScanStrategy::corners_sparse, 1000);
    check_in_view(windows);
    for (const Window& w : windows) CHECK((w.name == "corner" || w.name == "surface"));
    // Beams into the windows meet the target, at the place meant: all but a few windows return.
    ScanMaker lidar(model->target.mesh);
    lidar.pose = pose;
    int empty = 0;
    for (const Window& w : windows) {
      const auto scan = lidar.sweep(w);
      empty += std::none_of(scan.begin(), scan.end(),
                            [](const RawBeam& b) { return b.status == BeamStatus::hit; })
                   ? 1
                   : 0;
    }
    CHECK(10 * empty <= static_cast<int>(windows.size()));
  }
}

TEST_CASE("Regions on the far side are left out") {
  Target box;
  box.name = "box";
  box.mesh = make_box({2, 1, 1});
  box.hash = content_hash(box.mesh);
  ModelOptions coarse;
  coarse.grid_voxels = 20000;
  const auto model = compile_target_model(box, coarse);
  const ScanPlanner planner(*model, {}, planner_options);
  // seen along z from below: the face z = -0.5
  const auto seen =
      planner.visible({{0, 0, 6}, Quaterniond::Identity()}, ScanRegion::Kind::surface);
  REQUIRE_FALSE(seen.empty());
  for (const ScanRegion* region : seen) CHECK(region->position.z() < 0.45F);
  const auto all = std::count_if(model->regions.begin(), model->regions.end(),
                                 [](const auto& r) { return r.kind == ScanRegion::Kind::surface; });
  CHECK(static_cast<std::ptrdiff_t>(seen.size()) < all);
}

TEST_CASE("Windows shrink with distance and grow with uncertainty") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, {}, planner_options);
  const auto width = [&](double range, double sigma) {
    const auto windows =
        planner.plan({{0, 0, range}, Quaterniond::Identity()}, sigma, ScanStrategy::corners, 1000);
    double widest = 0;
    for (const Window& w : windows) widest = std::max(widest, w.width);
    return widest;
  };
  CHECK(width(10, 0.005) == Approx(0.5 * width(5, 0.005)).epsilon(0.1));
  CHECK(width(5, 0.05) > 1.2 * width(5, 0.005));
}

TEST_CASE("A target larger than the field of view is scanned where it is in view") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, {}, planner_options);
  const Pose pose = pose_from_xyzwpr({0, 0, 3300, 0, 0, 0});
  const auto windows = planner.plan(pose, 0.005, ScanStrategy::corners_sparse, 1000);
  check_in_view(windows);
  CHECK(windows.size() > 8);
  CHECK(beams_of(windows) >= 1000);
}

TEST_CASE("A target out of view has no windows") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, {}, planner_options);
  CHECK(planner.plan({{20, 0, 5}, Quaterniond::Identity()}, 0.01, ScanStrategy::corners, 1000)
            .empty());
  CHECK(
      planner.plan({{0, 0, -5}, Quaterniond::Identity()}, 0.01, ScanStrategy::dense, 1000).empty());
}

TEST_CASE("Strategies are known by the paper's names") {
  ScanStrategy strategy{};
  CHECK(parse_scan_strategy("edges+sparse", strategy));
  CHECK(strategy == ScanStrategy::edges_sparse);
  CHECK_FALSE(parse_scan_strategy("everywhere", strategy));
}

TEST_CASE("Beams on corners and edges go where they tell most of the pose") {
  const auto model = replica_model();
  const FieldOfView field;
  PlannerOptions informed = planner_options;
  informed.equal_share = 0.25;
  const auto strategy = GENERATE(ScanStrategy::corners, ScanStrategy::edges,
                                 ScanStrategy::corners_sparse, ScanStrategy::edges_sparse);
  const ScanPlanner planner(*model, field, planner_options);
  Random random(2, "shares");
  double shared = 0;
  double equal = 0;
  for (int i = 0; i < 5; ++i) {
    const Pose pose = random_pose(random, 7);
    const PoseView view(*model, &planner.scene(), field.beam, planner_options, pose);
    const auto trace = [&](const PlannerOptions& o) {
      int returns = 0;
      const auto windows = ScanPlanner(*model, field, o).plan(pose, 0.005, strategy, 1000);
      check_in_view(windows);
      const Matrix6d information = scan_information(view, windows, &returns);
      CHECK(returns == Approx(1000).epsilon(0.1));
      return (information + Matrix6d::Identity()).inverse().trace();
    };
    shared += trace(informed);
    equal += trace(planner_options);
  }
  CHECK(shared < equal);
}
