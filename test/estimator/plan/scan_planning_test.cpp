// SPDX-License-Identifier: BSD-3-Clause
// Scan planning: the paper's strategies, and windows by A-optimal design.
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "estimator/plan/information_planner.h"
#include "estimator/plan/pose_information.h"
#include "estimator/plan/scan_planner.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

/// The surface is the mesh, and most beams are planned.
const PlannerOptions planner_options = [] {
  PlannerOptions options;
  options.bare_surface_sigma_m = 0;
  options.spread_share = 0.1;
  return options;
}();

int beams_of(const std::vector<Window>& windows) {
  int sum = 0;
  for (const Window& w : windows) sum += w.count;
  return sum;
}

/// Each window has beams, and lies inside the field of view.
void check_in_view(const std::vector<Window>& windows, const FieldOfView& view = {}) {
  for (const Window& w : windows) {
    CHECK(std::abs(w.azimuth) + 0.5 * w.width <= 0.5 * view.width + 1e-9);
    CHECK(std::abs(w.elevation) + 0.5 * w.height <= 0.5 * view.height + 1e-9);
    CHECK(w.width > 0);
    CHECK(w.height > 0);
    CHECK(w.count > 0);
  }
}

const FieldOfView field;

std::shared_ptr<const TargetModel> box_model(const Vector3d& size) {
  Target box;
  box.name = "box";
  box.mesh = make_box(size);
  box.hash = content_hash(box.mesh);
  box.length = size.maxCoeff();
  ModelOptions coarse;
  coarse.surface_samples = 4000;
  coarse.grid_voxels = 20000;
  return compile_target_model(box, coarse);
}

/// No window requests more beams than the scanner has steps in it.
void check_steps(const std::vector<Window>& windows) {
  for (const Window& w : windows) {
    CHECK(w.width * w.height >= w.count * field.minimum_step * field.minimum_step);
  }
}

/// Root of the minimum trace of the covariance, with a weak prior for what no surface holds.
double rms_bound(const Matrix6d& information, double half_length) {
  const Matrix6d prior = Matrix6d::Identity() / std::pow(0.3 * half_length, 2);
  return std::sqrt((prior + information).llt().solve(Matrix6d::Identity()).trace());
}

/// The returns of a dense even scan of the target, one information matrix a column.
Eigen::Matrix<double, 21, Eigen::Dynamic> dense_view(const PoseView& view, Window outline) {
  outline.count = 10000;
  Eigen::Matrix<double, 21, Eigen::Dynamic> returns(21, outline.count);
  std::vector<Vector3d> directions;
  append_raster(outline, directions);
  std::vector<BeamReturn> beams(directions.size());
  view.returns(directions, beams);
  Eigen::Index count = 0;
  for (const BeamReturn& beam : beams) {
    if (!beam.root.isZero(0)) returns.col(count++) = packed_square(beam.root);
  }
  return returns.leftCols(count);
}

}  // namespace

TEST_CASE("Returns are shared out as the A-optimal design of known form") {
  // Each candidate measures one parameter, the i-th with information a_i^2: shares go as 1 / a_i.
  DesignProblem problem;
  problem.returns = 1e6;
  problem.prior = 1e-6 * Matrix6d::Identity();
  auto& information = problem.information.emplace_back(21, 6);
  double sum = 0;
  for (int i = 0; i < 6; ++i) {
    information.col(i) = packed_square((1.0 + i) * Vector6d::Unit(i));
    sum += 1 / (1.0 + i);
  }
  const Design design = a_optimal_design(problem, 24, 1e-4);
  REQUIRE(design.candidates.size() == 6);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(design.shares[i] == Approx(1 / ((1.0 + design.candidates[i]) * sum)).margin(0.005));
  }
  CHECK(design.trace == Approx(sum * sum / 1e6).epsilon(1e-3));
  CHECK(design.min_trace <= design.trace);
  CHECK(design.min_trace > 0.999 * design.trace);
}

TEST_CASE("A design has a bound on its distance from the optimum") {
  Random random(3, "design");
  DesignProblem problem;
  problem.returns = 100;
  auto& information = problem.information.emplace_back(21, 300);
  for (int i = 0; i < 300; ++i) {
    Vector6d root;
    root << random.normal_vector(1), random.normal_vector(3);
    information.col(i) = packed_square(root);
  }
  const Design best = a_optimal_design(problem, 24, 1e-4);
  CHECK(best.trace - best.min_trace < 1e-3 * best.trace);
  const Design rough = a_optimal_design(problem, 24, 0.05);
  CHECK(rough.min_trace <= best.trace);
  CHECK(rough.trace < 1.06 * best.trace);
  CHECK(a_optimal_design(problem, 6, 0.01).candidates.size() <= 6);
}

TEST_CASE("Shares become whole numbers that sum up") {
  for (const int count : {0, 1, 2, 10, 999, 50000}) {
    const auto counts = apportioned({0.5, 0.2, 0.2, 0.0999, 0.0001}, count);
    CHECK(std::accumulate(counts.begin(), counts.end(), 0) == count);
    CHECK(std::abs(counts[0] - 0.5 * count) <= 1);
  }
}

TEST_CASE("A plate is scanned at its far corners, evenly") {
  const auto model = box_model({2, 1, 0.02});
  const ScanPlanner planner(*model, field, planner_options);
  double in_quadrant[2][2] = {};
  for (const Window& w :
       planner.plan({{0, 0, 6}, Quaterniond::Identity()}, 0.002, ScanStrategy::information, 1000)) {
    if (w.name != "information") continue;  // the tenth that is spread out
    CHECK(std::abs(6 * std::tan(w.azimuth)) > 0.75);
    CHECK(std::abs(6 * std::tan(w.elevation)) > 0.35);
    in_quadrant[w.azimuth > 0 ? 1 : 0][w.elevation > 0 ? 1 : 0] += w.count;
  }
  for (const auto& side : in_quadrant) {
    for (const double count : side) CHECK(count == Approx(225).margin(45));
  }
}

TEST_CASE("Planned windows beat even ones with as many returns on every shape in every pose") {
  const std::shared_ptr<const TargetModel> shapes[] = {replica_model(), cube_model(),
                                                       box_model({3, 0.8, 0.5})};
  Random random(11, "information");
  double gain = 0;
  int trials = 0;
  for (const auto& model : shapes) {
    const ScanPlanner planner(*model, field, planner_options);
    for (int i = 0; i < 12; ++i) {
      const Pose pose = random_pose(random, random.uniform(5, 8));
      const int beams = i % 2 == 0 ? 1000 : 300;
      const PoseView view(*model, &planner.scene(), field.beam, planner_options, pose);
      const auto windows = planner.plan(pose, 0.002, ScanStrategy::information, beams);
      CHECK(beams_of(windows) == beams);
      check_in_view(windows);
      check_steps(windows);
      int returns = 0;
      const double planned =
          rms_bound(scan_information(view, windows, &returns), model->canonical.half_length);
      CHECK(returns > 0.4 * beams);  // beams past an edge are informative, too
      Window everywhere = planner.around({pose}, 0, 10000).front();
      int of_many = 0;
      scan_information(view, {everywhere}, &of_many);
      everywhere.count = static_cast<int>(std::lround(1e4 * returns / of_many));
      const double even =
          rms_bound(scan_information(view, {everywhere}), model->canonical.half_length);
      CHECK(planned < 1.001 * even);
      if (model != shapes[0]) continue;  // a box seen face on moves freely along the face
      gain += std::log(even / planned);
      ++trials;
    }
  }
  CHECK(std::exp(gain / trials) > 1.5);
}

TEST_CASE("Windows lose little against single rays chosen best") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, field, planner_options);
  Random random(5, "best-rays");
  constexpr int beams = 1000;
  double planned = 0;
  double best = 0;
  for (int i = 0; i < 10; ++i) {
    Vector6d off;
    off << random.normal_vector(0.05), random.normal_vector(radians(7));
    const Pose pose = perturbed(pose_from_xyzwpr({100, -230, 8000, 25, 20, -30}), off);
    const PoseView view(*model, &planner.scene(), field.beam, planner_options, pose);
    const double half_length = model->canonical.half_length;
    planned += std::pow(
        rms_bound(
            scan_information(view, planner.plan(pose, 0.002, ScanStrategy::information, beams)),
            half_length),
        2);
    // Frank and Wolfe's steps towards the best 1,000 of the rays, each at most once.
    const auto rays = dense_view(view, planner.around({pose}, 0, 1).front());
    const auto count = static_cast<std::size_t>(rays.cols());
    Eigen::VectorXd shares = Eigen::VectorXd::Constant(rays.cols(), beams / double(count));
    double trace = 0;
    for (int step = 0; step < 100; ++step) {
      const Matrix6d covariance =
          (unpacked(rays * shares) + Matrix6d::Identity() / std::pow(0.3 * half_length, 2))
              .llt()
              .solve(Matrix6d::Identity());
      trace = covariance.trace();
      PackedMatrix slope = packed(2 * covariance * covariance);
      for (int row = 0, d = 0; row < 6; d += 6 - row, ++row) slope[d] *= 0.5;
      const Eigen::VectorXd gain = rays.transpose() * slope;
      std::vector<Eigen::Index> order(count);
      std::iota(order.begin(), order.end(), Eigen::Index{0});
      std::nth_element(order.begin(), order.begin() + beams, order.end(),
                       [&](Eigen::Index a, Eigen::Index b) { return gain[a] > gain[b]; });
      const double rate = 2.0 / (step + 3);
      shares *= 1 - rate;
      for (int n = 0; n < beams; ++n) shares[order[static_cast<std::size_t>(n)]] += rate;
    }
    best += trace;
  }
  CHECK(std::sqrt(planned / best) < 1.25);
}

TEST_CASE("The same pose gives the same windows to the bit") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, field, planner_options);
  const Pose pose = pose_from_xyzwpr({100, -230, 8000, 25, 20, -30});
  const auto once = planner.plan(pose, 0.004, ScanStrategy::information, 1000);
  const auto again = planner.plan(pose, 0.004, ScanStrategy::information, 1000);
  REQUIRE(once.size() == again.size());
  for (std::size_t i = 0; i < once.size(); ++i) {
    CHECK(once[i].azimuth == again[i].azimuth);
    CHECK(once[i].elevation == again[i].elevation);
    CHECK(once[i].width == again[i].width);
    CHECK(once[i].count == again[i].count);
  }
}

TEST_CASE("Any number of beams is planned, near and far, within the LIDAR's limits") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, field, planner_options);
  for (const double range : {3.3, 8.0, 60.0, 300.0}) {
    const Pose pose = pose_from_xyzwpr({0.02 * range * 1e3, 0, 1e3 * range, 25, 20, -30});
    for (const int beams : {1, 2, 7, 40, 200, 1000, 50000}) {
      const auto windows = planner.plan(pose, 0.005, ScanStrategy::information, beams);
      CHECK(beams_of(windows) == beams);
      CHECK(static_cast<int>(windows.size()) <= 2 * planner_options.max_windows);
      check_in_view(windows);
      check_steps(windows);
    }
  }
}

TEST_CASE("What the prediction leaves open widens the windows") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, field, planner_options);
  const Pose pose = pose_from_xyzwpr({100, -230, 8000, 25, 20, -30});
  double before = 0;
  for (const double sigma : {0.001, 0.01, 0.03, 0.1}) {
    const auto windows = planner.plan(pose, sigma, ScanStrategy::information, 1000);
    double narrowest = 10;
    for (const Window& w : windows) {
      if (w.name == "information") narrowest = std::min(narrowest, w.width);
    }
    CHECK(narrowest > before);
    before = narrowest;
    // They meet the target although it is not where it should be.
    Random random(7, "off");
    int returns = 0;
    constexpr int trials = 10;
    for (int i = 0; i < trials; ++i) {
      Vector6d off;
      off << random.normal_vector(sigma / std::sqrt(2)),
          random.normal_vector(sigma / std::sqrt(2) / model->canonical.half_length);
      int hits = 0;
      scan_information(
          PoseView(*model, &planner.scene(), field.beam, planner_options, perturbed(pose, off)),
          windows, &hits);
      returns += hits;
    }
    CHECK(returns > trials * 600);
  }
}

TEST_CASE("Whatever of the target is in view is planned for") {
  const auto model = replica_model();
  const ScanPlanner planner(*model, field, planner_options);
  Random random(9, "partial");
  int partial = 0;
  for (int i = 0; i < 30; ++i) {
    const double range = random.uniform(3.2, 5);
    const Pose pose{{range * random.uniform(-0.6, 0.6), range * random.uniform(-0.6, 0.6), range},
                    random.rotation()};
    const PoseView view(*model, &planner.scene(), field.beam, planner_options, pose);
    int seen = 0;
    scan_information(view, {planner.everything(3000)}, &seen);
    const auto windows = planner.plan(pose, 0.005, ScanStrategy::information, 500);
    check_in_view(windows);
    check_steps(windows);
    if (seen == 0) continue;
    ++partial;
    CHECK(beams_of(windows) == 500);
    int returns = 0;
    scan_information(view, windows, &returns);
    CHECK(returns > (seen > 20 ? 150 : 0));
  }
  CHECK(partial > 15);
  CHECK(planner.plan({{20, 0, 5}, Quaterniond::Identity()}, 0.01, ScanStrategy::information, 100)
            .empty());
  CHECK(planner.plan({{0, 0, -5}, Quaterniond::Identity()}, 0.01, ScanStrategy::information, 100)
            .empty());
}

TEST_CASE("Returns of a patch with a common error are no more informative than the patch's sigma") {
  const auto model = box_model({2, 1, 0.5});
  PlannerOptions alike = planner_options;
  alike.bare_surface_sigma_m = 0.004;
  const Pose pose{{0, 0, 6}, Quaterniond::Identity()};
  const PoseView exact(*model, nullptr, field.beam, planner_options, pose);
  const PoseView erring(*model, nullptr, field.beam, alike, pose);
  Window small{0,   0, 0.01, 0.01, Pattern::raster,
               100, 0, ""};  // 60 mm wide: within a patch or four
  const auto of_range = [&](const PoseView& view, int count) {
    small.count = count;
    return scan_information(view, {small}).topLeftCorner<3, 3>().trace();
  };
  const double one = of_range(exact, 1);
  CHECK(of_range(exact, 900) == Approx(900 * one).epsilon(0.01));
  // 1 / (noise^2 / n + surface^2) of each patch
  const double shared = 0.004 * 0.004 * one;
  const double lower_bound = 900 * one / (1 + 900 * shared);
  CHECK(of_range(erring, 900) > 0.99 * lower_bound);
  CHECK(of_range(erring, 900) < 4.01 / (0.004 * 0.004));
  CHECK(of_range(erring, 1) == Approx(one / (1 + shared)).epsilon(0.01));
}

TEST_CASE("An edge beam has the Fisher information of whether it returns") {
  const auto model = box_model({2, 1, 0.02});
  const ScanPlanner planner(*model, field, planner_options);
  const Pose pose{{0, 0, 6}, Quaterniond::Identity()};
  const PoseView view(*model, &planner.scene(), field.beam, planner_options, pose);
  // About the middle of the right edge, 200 mm long and wide; the faces' information is subtracted.
  Window window{std::atan(1 / 6.0), 0, 0.2 / 6, 0.2 / 6, Pattern::raster, 1000, 0, ""};
  const PoseView faces(*model, nullptr, field.beam, planner_options, pose);
  const Matrix6d information = scan_information(view, {window}) - scan_information(faces, {window});
  // Beams at random places: Fisher information of a Bernoulli trial with p = Phi(d / width).
  const double width =
      std::hypot(0.25 * field.beam.footprint(6), 6 * std::sqrt(field.beam.angle_variance()));
  double sum = 0;
  constexpr int steps = 200000;
  for (int i = 0; i < steps; ++i) {
    const double z = ((i + 0.5) / steps - 0.5) * 0.2 / width;
    if (std::abs(z) > 6) continue;
    const double density = std::exp(-0.5 * z * z) / std::sqrt(2 * 3.14159265358979);
    const double p = 0.5 * std::erfc(-z / std::sqrt(2.0));
    sum += density * density / (p * (1 - p)) / (width * width) / steps;
  }
  CHECK(information(0, 0) == Approx(1000 * sum).epsilon(0.1));  // across the edge
  CHECK(information(1, 1) < 0.01 * information(0, 0));          // nothing along it
}

TEST_CASE("Every strategy brings the requested returns, from windows inside the field of view") {
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
  const int requested = dense ? 10000 : 1000;
  CHECK(hits <= 1.3 * requested);
  // A thin target far away leaves most of its windows empty: not more than ten times the beams.
  if (beams_of(windows) < 9.9 * requested) CHECK(hits >= 0.9 * requested);
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

TEST_CASE("Beams on corners and edges go where they are most informative on the pose") {
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
