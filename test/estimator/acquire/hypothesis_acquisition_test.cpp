// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/hypothesis_acquisition.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numbers>

#include "estimator/acquire/segmentation.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

using Status = AcquisitionResult::Status;

const BeamModel near_lidar = [] {
  BeamModel beam;
  beam.range_min_m = 0.5;
  return beam;
}();
const HypothesisAcquisitionOptions hypotheses_by_default;
const RangeGate cell_gate{1, 9};

const Mesh panel = make_box({1.2, 0.5, 0.03});
const Pose panel_pose{{0.95, 0, 0.1}, Quaterniond::Identity()};
/// A small body with a mast, and next to it its panel: no two sides alike.
Mesh body() {
  Mesh mesh = make_box({0.7, 0.5, 0.5});
  mesh.append(make_box({0.1, 0.1, 0.6}), {{-0.2, 0.1, 0.5}, Quaterniond::Identity()});
  return mesh;
}

std::shared_ptr<const TargetModel> bare_model(const Mesh& mesh, const std::string& name) {
  Target target;
  target.mesh = mesh;
  target.name = name;
  target.hash = content_hash(target.mesh);
  target.length = bounding_box(target.mesh).size().maxCoeff();
  ModelOptions coarse;
  coarse.surface_samples = 6000;
  coarse.grid_voxels = 150000;
  return load_target_model(target, coarse, std::filesystem::path("build") / "test-models");
}

std::shared_ptr<const TargetModel> lopsided() {
  static const auto model = [] {
    Mesh mesh = body();
    mesh.append(panel, panel_pose);
    return bare_model(mesh, "lopsided");
  }();
  return model;
}

const HypothesisAcquisition& acquisition() {
  static const HypothesisAcquisition made(*lopsided(), near_lidar, hypotheses_by_default);
  return made;
}

/// Floor, wall and a column, on which most of the returns fall.
Mesh cell() {
  Mesh mesh = make_box({8, 0.1, 8});
  for (Vector3d& v : mesh.vertices) v += Vector3d(0, 1.7, 6);
  mesh.append(make_box({9, 6, 0.1}), {{0, 0, 8}, Quaterniond::Identity()});
  mesh.append(make_cylinder(0.25, 2.5, 24),
              {{0.9, 0.5, 6.2}, rotation_from_vector({std::numbers::pi / 2, 0, 0})});
  return mesh;
}

PreprocessedScan scan_of_cell(const Pose& pose, std::uint64_t seed, bool target = true) {
  ScanMaker lidar(target ? lopsided()->target.mesh : make_box({0.01, 0.01, 0.01}), seed);
  lidar.beam = near_lidar;
  lidar.pose = pose;
  if (!target) lidar.pose.position = {0, 0, -5};
  lidar.add_clutter(cell());
  return preprocess(lidar.sweep(full_view(6000)), cell_gate, near_lidar);
}

Pose attraction(Random& random) {
  Pose pose = random_pose(random, 5);
  pose.position.x() += random.uniform(-0.3, 0.3);
  return pose;
}

bool right(const Pose& pose, const TargetModel& model, const Pose& truth) {
  return model.symmetries.angle_between(pose, truth) < radians(5) &&
         model.symmetries.distance(pose, truth) < 0.05 * model.target.length;
}
bool right(const Pose& pose, const Pose& truth) { return right(pose, *lopsided(), truth); }

bool has(const AcquisitionResult& found, const TargetModel& model, const Pose& truth) {
  return (found.status == Status::found || found.status == Status::ambiguous) &&
         std::any_of(found.hypotheses.begin(), found.hypotheses.end(),
                     [&](const Hypothesis& h) { return right(h.pose, model, truth); });
}
bool has(const AcquisitionResult& found, const Pose& truth) {
  return has(found, *lopsided(), truth);
}

/// Something, alone in space, that is modelled as something else.
PreprocessedScan scan_of(const Mesh& mesh, const Mesh& modelled, const Pose& pose, int beams,
                         std::uint64_t seed) {
  ScanMaker lidar(mesh, seed);
  lidar.beam = near_lidar;
  lidar.pose = pose;
  return preprocess(sweep_around(lidar, modelled, beams), cell_gate, near_lidar);
}

}  // namespace

TEST_CASE("Among floor, wall and column the target is found without a guess of where") {
  Random random(1, "hypotheses");
  for (std::uint64_t i = 0; i < 6; ++i) {
    const Pose truth = attraction(random);
    const PreprocessedScan scan = scan_of_cell(truth, i + 1);
    CAPTURE(i);
    // The decision alone: what is true must pass, wherever the search would have ended.
    const AcquisitionResult at_truth = acquisition().evaluate(scan, {truth});
    CAPTURE(at_truth.reason);
    REQUIRE_FALSE(at_truth.hypotheses.empty());
    CHECK(at_truth.status != Status::not_found);
    const AcquisitionResult found = acquisition().acquire(scan);
    CAPTURE(found.reason);
    CHECK(has(found, truth));
    if (found.status == Status::found) CHECK(right(found.hypotheses.front().pose, truth));
  }
}

TEST_CASE("Behind a plate that is much nearer and hides half of it the target is found") {
  Random random(5, "hypotheses");
  int found_right = 0;
  for (std::uint64_t i = 0; i < 6; ++i) {
    const Pose truth = attraction(random);
    ScanMaker lidar(lopsided()->target.mesh, i + 1);
    lidar.beam = near_lidar;
    lidar.pose = truth;
    const Vector3d edge = 0.5 * (truth * lopsided()->centre);
    const double turn = random.uniform(0, 2 * std::numbers::pi);
    Mesh plate;
    plate.append(make_box({0.8, 1.2, 0.01}), Pose{edge, rotation_from_vector({0, 0, turn})} *
                                                 Pose{{0.4, 0, 0}, Quaterniond::Identity()});
    lidar.add_clutter(plate);
    const PreprocessedScan scan = preprocess(lidar.sweep(full_view(12000)), cell_gate, near_lidar);
    const AcquisitionResult found = acquisition().acquire(scan);
    CAPTURE(i, found.reason);
    // Never what hides it.
    if (found.status == Status::found) CHECK(right(found.hypotheses.front().pose, truth));
    if (has(found, truth)) ++found_right;
  }
  CHECK(found_right >= 5);
}

TEST_CASE("A target of which one of two panels is gone is found") {
  Mesh without = make_box({0.5, 0.4, 0.6});
  without.append(make_box({0.3, 0.3, 0.3}), {{0, 0.5, 0.2}, Quaterniond::Identity()});
  const Mesh wing = make_box({0.9, 0.4, 0.03});
  without.append(wing, {{-0.7, 0, 0}, Quaterniond::Identity()});
  Mesh whole = without;
  whole.append(wing, {{0.7, 0, 0}, Quaterniond::Identity()});
  const auto model = bare_model(whole, "winged");
  const HypothesisAcquisition winged(*model, near_lidar, hypotheses_by_default);
  Random random(13, "hypotheses");
  int found_right = 0, wrong = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const Pose truth = random_pose(random, 5);
    const AcquisitionResult found = winged.acquire(scan_of(without, whole, truth, 1500, i + 1));
    if (has(found, *model, truth)) {
      ++found_right;
    } else if (found.status == Status::found) {
      ++wrong;
    }
  }
  CHECK(found_right >= 38);
  CHECK(wrong == 0);
}

TEST_CASE(
    "Of a bent target neither part's pose is called the only one where both are as probable") {
  Random random(13, "hypotheses");
  const Pose joint{{0.35, 0, 0.1}, Quaterniond::Identity()};
  int wrong = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    const Pose truth = random_pose(random, 5);
    Pose bend;
    bend.rotation = rotation_from_vector({0, (i % 2 == 0 ? 1 : -1) * radians(8), 0});
    Mesh bent = body();
    bent.append(panel, joint * bend * joint.inverse() * panel_pose);
    const AcquisitionResult found =
        acquisition().acquire(scan_of(bent, lopsided()->target.mesh, truth, 3000, i + 1));
    if (found.status == Status::found && !has(found, *lopsided(), truth)) ++wrong;
  }
  CHECK(wrong <= 2);
}

TEST_CASE("Where the target is not, it is lost, and the odds are reported") {
  const AcquisitionResult result = acquisition().acquire(scan_of_cell({}, 7, false));
  CHECK(result.status == Status::not_found);
  CHECK_THAT(result.reason, Catch::Matchers::Contains("required"));
}

TEST_CASE("Noise is estimated from neighbouring ranges, not less than the scanner's own") {
  Random random(6, "hypotheses");
  const Pose truth = attraction(random);
  for (const double factor : {0.3, 1.0, 3.0}) {
    ScanMaker lidar(lopsided()->target.mesh, 8);
    lidar.beam = near_lidar;
    lidar.beam.range_sigma_m *= factor;
    lidar.pose = truth;
    lidar.add_clutter(cell());
    const PreprocessedScan scan = preprocess(lidar.sweep(full_view(6000)), cell_gate, near_lidar);
    CHECK_THAT(RangeImage(scan, near_lidar).noise_scale(),
               Catch::Matchers::WithinRel(std::max(1.0, factor), 0.15));
  }
}

TEST_CASE("A flat target is found by its outline, in few rows of returns of its own alone") {
  Mesh quadrilateral;
  quadrilateral.vertices = {{-0.6, -0.2, 0}, {0.5, -0.3, 0}, {0.3, 0.4, 0}, {-0.2, 0.3, 0}};
  quadrilateral.triangles = {{0, 1, 2}, {0, 2, 3}};
  Target target;
  target.mesh = quadrilateral;
  target.name = "quadrilateral";
  target.hash = content_hash(target.mesh);
  target.length = 1.1;
  ModelOptions coarse;
  coarse.surface_samples = 4000;
  coarse.grid_voxels = 60000;
  const auto model = compile_target_model(target, coarse);
  const HypothesisAcquisition flat(*model, near_lidar, hypotheses_by_default);
  for (const int rows : {8, 16}) {
    ScanMaker lidar(quadrilateral, 9);
    lidar.beam = near_lidar;
    lidar.pose = {{0.1, 0, 10}, rotation_from_vector({0.2, 0.3, 0.4})};
    std::vector<RawBeam> beams;
    for (int row = 0; row < rows; ++row) {
      for (double azimuth = -0.08; azimuth < 0.1; azimuth += 0.0035) {
        const RawBeam beam = lidar.shoot(azimuth, 0.08 * (2.0 * row / (rows - 1) - 1));
        if (beam.status == BeamStatus::hit) beams.push_back(beam);
      }
    }
    const AcquisitionResult found = flat.acquire(preprocess(beams, {1, 20}, near_lidar));
    CAPTURE(rows, beams.size(), found.reason);
    REQUIRE((found.status == Status::found || found.status == Status::ambiguous));
    CHECK(std::any_of(found.hypotheses.begin(), found.hypotheses.end(), [&](const Hypothesis& h) {
      return model->symmetries.angle_between(h.pose, lidar.pose) < radians(7) &&
             model->symmetries.distance(h.pose, lidar.pose) < 0.08;
    }));
  }
}

TEST_CASE("The order of beams does not matter to hypotheses") {
  Random random(2, "hypotheses");
  PreprocessedScan scan = scan_of_cell(attraction(random), 3);
  const AcquisitionResult before = acquisition().acquire(scan);
  REQUIRE_FALSE(before.hypotheses.empty());
  std::reverse(scan.beams.begin(), scan.beams.end());
  std::reverse(scan.points.begin(), scan.points.end());
  const AcquisitionResult after = acquisition().acquire(scan);
  REQUIRE(after.hypotheses.size() == before.hypotheses.size());
  CHECK(after.hypotheses.front().log_likelihood == before.hypotheses.front().log_likelihood);
  CHECK(after.hypotheses.front().pose.position == before.hypotheses.front().pose.position);
}

TEST_CASE("Floor and wall leave the search, the target does not") {
  Random random(3, "hypotheses");
  const Pose truth = attraction(random);
  const PreprocessedScan scan = scan_of_cell(truth, 5);
  const RangeImage image(scan, near_lidar);
  const LargePlanes large = large_planes(image, 2.15 * lopsided()->radius);
  int on_target = 0, lost = 0, room = 0, left = 0;
  for (std::size_t b = 0; b < image.beams().size(); ++b) {
    const Beam& beam = image.beams()[b];
    if (!beam.hit()) continue;
    const Vector3d p = truth.inverse() * beam.point();
    const bool target = (lopsided()->caster.nearest(p) - p).norm() < 0.03;
    ++(target ? on_target : room);
    if (target && large.holds(b)) ++lost;
    if (!target && !large.holds(b)) ++left;
  }
  REQUIRE(on_target > 80);
  CHECK(lost < on_target / 20);
  CHECK(left < room / 2);
}

TEST_CASE("A floor of which a part is scanned again, more densely, is a plane all over") {
  ScanMaker lidar(lopsided()->target.mesh, 12);
  lidar.beam = near_lidar;
  lidar.add_clutter(cell());
  Window closer = full_view(2000);
  closer.name = "closer";
  closer.width = closer.height = radians(10);
  closer.elevation -= radians(12);
  const RangeImage image(preprocess(lidar.sweep({full_view(6000), closer}), cell_gate, near_lidar),
                         near_lidar);
  const LargePlanes large = large_planes(image, 2.15 * lopsided()->radius);
  int floor = 0, held = 0;
  for (std::size_t b = 0; b < image.beams().size(); ++b) {
    const Beam& beam = image.beams()[b];
    if (!beam.hit() || std::abs(beam.point().y() - 1.65) > 0.02) continue;
    ++floor;
    if (large.holds(b)) ++held;
  }
  REQUIRE(floor > 2000);
  CHECK(held > 0.95 * floor);
}

TEST_CASE("The gradient of the odds is that of numeric differences") {
  Random random(4, "hypotheses");
  const Pose truth = attraction(random);
  const PreprocessedScan scan = scan_of_cell(truth, 6);
  const RangeImage image(scan, near_lidar);
  const PoseOdds odds(*lopsided(), image, 0.004);
  // Widened, and as they are: then each piece of the surface is off as one.
  for (const double annealing : {0.05, 0.0}) {
    const Pose off = annealing > 0 ? displaced(truth, random, 0.02, radians(1))
                                   : displaced(truth, random, 0.004, radians(0.2));
    const PoseOdds::At at = odds.at(off, annealing, 1);
    REQUIRE(at.expected > 50);
    // Shares are held in the gradient, and beams at rims are left out: small steps, and all
    // directions together.
    Vector6d numeric;
    const double step = 1e-6;
    for (int i = 0; i < 6; ++i) {
      const Vector6d d = step * Vector6d::Unit(i);
      numeric[i] = (odds.at(perturbed(off, d), annealing, 1).log_odds -
                    odds.at(perturbed(off, -d), annealing, 1).log_odds) /
                   (2 * step);
    }
    CAPTURE(annealing, numeric.transpose(), at.gradient.transpose());
    CHECK((numeric - at.gradient).norm() < 0.1 * numeric.norm());
    CHECK(Eigen::SelfAdjointEigenSolver<Matrix6d>(at.information).eigenvalues().minCoeff() >
          -1e-6 * at.information.trace());
  }
}

namespace {

/// A box of plates that one looks into (towards +z), with a fin, without its lid.
Mesh open_box() {
  constexpr double thick = 0.02;
  Mesh mesh = make_box({1, 0.8, thick});
  for (Vector3d& v : mesh.vertices) v.z() += 0.5;
  for (const double side : {-1.0, 1.0}) {
    mesh.append(make_box({thick, 0.8, 1}), {{0.5 * side, 0, 0}, Quaterniond::Identity()});
    mesh.append(make_box({1, thick, 1}), {{0, 0.4 * side, 0}, Quaterniond::Identity()});
  }
  mesh.append(make_box({0.4, thick, 0.5}), {{0.7, 0.1, 0.2}, Quaterniond::Identity()});
  return mesh;
}

}  // namespace

TEST_CASE("Where a lid is gone, returns from inside support the target, and move it") {
  const Mesh open = open_box();
  Mesh closed = open;
  closed.append(make_box({1, 0.8, 0.02}), {{0, 0, -0.5}, Quaterniond::Identity()});
  const auto model = bare_model(closed, "lidded");
  Pose truth;
  truth.position = {0, 0, 4};
  truth.rotation = rotation_from_vector({0.15, 0.2, 0.1});
  const PreprocessedScan scan = scan_of(open, closed, truth, 1500, 1);
  const RangeImage image(scan, near_lidar);
  std::vector<char> other(image.beams().size(), 0);  // than those on the bottom
  for (std::size_t b = 0; b < other.size(); ++b) {
    const Vector3d p = truth.inverse() * image.beams()[b].point();
    const bool on_bottom = std::abs(p.x()) < 0.4 && std::abs(p.y()) < 0.3 && p.z() > 0.45;
    other[b] = image.beams()[b].hit() && on_bottom ? 0 : 1;
  }
  const PoseOdds inside = PoseOdds(*model, image, 0.004).without(other);
  const PoseOdds::At at = inside.at(truth, 0, 1);
  REQUIRE(at.expected > 200);
  CHECK(at.present < 0.1);
  CHECK(at.log_odds > 0);  // else each piece of the lid costs its ln 0.02

  const Pose off = perturbed(truth, (Vector6d() << 0, 0, 0.004, 0.002, 0.002, 0).finished());
  const PoseOdds::At there = inside.at(off, 0, 1);
  Vector6d numeric;
  const double step = 1e-6;
  for (int i = 0; i < 6; ++i) {
    const Vector6d d = step * Vector6d::Unit(i);
    numeric[i] =
        (inside.log_odds(perturbed(off, d), 0, 1) - inside.log_odds(perturbed(off, -d), 0, 1)) /
        (2 * step);
  }
  CAPTURE(numeric.transpose(), there.gradient.transpose());
  CHECK((numeric - there.gradient).norm() < 0.1 * numeric.norm());
}

TEST_CASE("Of how far a piece of the surface is off the odds are an integral") {
  const Mesh plate = make_box({1.2, 1.2, 0.02});
  const auto model = coarse_model(described(plate));
  ScanMaker lidar(plate, 11);
  lidar.beam = near_lidar;
  lidar.pose.position = {0, 0, 3};
  std::vector<RawBeam> beams;  // all on one piece
  for (int i = -7; i <= 7; ++i) {
    for (int j = -7; j <= 7; ++j) beams.push_back(lidar.shoot(0.0017 * i, 0.0017 * j));
  }
  const RangeImage image(preprocess(beams, {1, 5}, near_lidar), near_lidar);
  constexpr double sigma = 0.006;
  const PoseOdds off_as_one(*model, image, sigma);
  const PoseOdds as_modelled(*model, image, 0);
  const auto moved = [&](double z) {
    Pose pose = lidar.pose;
    pose.position.z() += z;
    return pose;
  };
  const auto integral = [&](double off) {
    constexpr double step = 0.00025;
    std::vector<double> logs;
    for (double d = -6 * sigma; d <= 6 * sigma; d += step) {
      logs.push_back(as_modelled.at(moved(off + d), 0, 1).log_odds - 0.5 * d * d / (sigma * sigma) +
                     std::log(step / (sigma * std::sqrt(2 * std::numbers::pi))));
    }
    const double highest = *std::max_element(logs.begin(), logs.end());
    double sum = 0;
    for (const double l : logs) sum += std::exp(l - highest);
    return highest + std::log(sum);
  };
  for (const double off : {0.0, 0.006, 0.012}) {
    CAPTURE(off);
    CHECK_THAT(off_as_one.at(moved(off), 0, 1).log_odds,
               Catch::Matchers::WithinAbs(integral(off), 1.5));
  }
  CHECK(as_modelled.at(moved(0.012), 0, 1).log_odds < integral(0.012) - 20);
}

TEST_CASE("Of two equally wrong poses neither is called right more often than stated") {
  Random random(9, "rivals");
  constexpr int trials = 4000;
  constexpr double risk = 0.1;
  int certain = 0, naive = 0;
  for (int i = 0; i < trials; ++i) {
    std::vector<double> best(300), other(300, 0.0);
    double lead = 0;
    for (double& b : best) lead += b = 0.5 * random.normal();
    if (lead < 0) {
      lead = -lead;
      best.swap(other);
    }
    if (rival_odds(lead, best, other, 0, 1e9) < risk / (1 - risk)) ++certain;
    if (std::exp(-lead) < risk / (1 - risk)) ++naive;
  }
  // Either of the two may lead.
  CHECK_THAT(static_cast<double>(certain) / trials, Catch::Matchers::WithinAbs(2 * risk, 0.03));
  CHECK(naive > trials / 2);
  const std::vector<double> alike(10, 0.3);
  CHECK(rival_odds(0, alike, alike, 0, 6) == 1);
  CHECK(rival_odds(20, std::vector<double>(100, 0.2), std::vector<double>(100, 0.0), 0, 6) < 1e-6);
}

TEST_CASE("Of two places that both look like the target one needs twice the log odds") {
  constexpr double required = 6;
  const auto odds = [&](double best, double other, double price) {
    // on other beams each
    constexpr int beams = 4000;
    std::vector<double> of_best(2 * beams, 0.0), of_other(2 * beams, 0.0);
    std::fill_n(of_best.begin(), beams, (best + price) / beams);
    std::fill_n(of_other.begin() + beams, beams, (other + price) / beams);
    return rival_odds(best - other, of_best, of_other, price, required);
  };
  // A rival that is hardly more probable than no target: its nats count as they are.
  CHECK(odds(15, 5, 20) == Approx(std::exp(-10)));
  // One that is sure of itself shows what the surroundings can do: twice as much decides.
  for (const double other : {50.0, 500.0}) {
    CHECK(odds(2 * other, other, 20) == Approx(std::exp(-required)));
    CHECK(odds(1.5 * other, other, 20) > std::exp(-0.6 * required));
  }
  // On the same beams it does not matter.
  std::vector<double> best(200, 0.5), other(200, 0.3);
  CHECK(rival_odds(40, best, other, 20, required) < std::exp(-20));
}

TEST_CASE("The evidence expected of a beam is the mean of what it gives") {
  constexpr double depth = 3;
  constexpr PoseShares w;
  const ExpectedRange near{5, 1e-4}, adjacent{5.02, 1.5e-4}, far{5.8, 1e-4}, nothing;
  Random random(8, "expected evidence");
  const auto density = [&](const ExpectedRange& m, double z) {
    if (!std::isfinite(m.range)) return 0.5 / depth;
    const double d = z - m.range;
    return w.hit * std::exp(-0.5 * d * d / m.variance) /
               std::sqrt(2 * std::numbers::pi * m.variance) +
           (w.front + w.through) / depth;
  };
  const auto misses = [&](const ExpectedRange& m) {
    return std::isfinite(m.range) ? w.missing : 0.5;
  };
  for (const ExpectedRange& truth : {near, adjacent, far, nothing}) {
    for (const ExpectedRange& other : {near, adjacent, far, nothing}) {
      double sum = 0;
      constexpr int draws = 40000;
      for (int i = 0; i < draws; ++i) {
        if (random.uniform() < misses(truth)) {
          sum += std::log(misses(truth) / misses(other));
          continue;
        }
        double z = 4 + depth * random.uniform();
        if (std::isfinite(truth.range) && random.uniform() < w.hit / (1 - w.missing)) {
          z = truth.range + std::sqrt(truth.variance) * random.normal();
        }
        sum += std::log(density(truth, z) / density(other, z));
      }
      CAPTURE(truth.range, other.range);
      // The formula takes hits at the expected range, and others where neither is.
      CHECK_THAT(expected_evidence(truth, other, depth),
                 Catch::Matchers::WithinAbs(sum / draws, 0.1 + 0.2 * std::abs(sum / draws)));
    }
  }
}
