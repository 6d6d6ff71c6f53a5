// SPDX-License-Identifier: BSD-3-Clause
// Acquisition of shapes that have the scan to themselves.

#include <algorithm>

#include "estimator/acquire/discriminating_windows.h"
#include "estimator/acquire/hypothesis_acquisition.h"
#include "test/catch.h"
#include "test/estimator/scan_maker.h"

using namespace berth;
using namespace berth::estimator;

namespace {

using Status = AcquisitionResult::Status;

const BeamModel beam_model = [] {
  BeamModel beam;
  beam.range_min_m = 0.5;
  return beam;
}();
const HypothesisAcquisitionOptions options;

std::shared_ptr<const TargetModel> model_of(const std::string& name, const Mesh& mesh) {
  Target target;
  target.name = name;
  target.mesh = mesh;
  target.hash = content_hash(mesh);
  target.length = bounding_box(mesh).size().maxCoeff();
  ModelOptions coarse;
  coarse.surface_samples = 6000;
  coarse.grid_voxels = 150000;
  return load_target_model(target, coarse, std::filesystem::path("build") / "test-models");
}

/// Flat and with no elongation, no two sides alike.
std::shared_ptr<const TargetModel> flat_box() {
  static const auto model = [] {
    Mesh mesh = make_box({2.4, 2.0, 0.5});
    mesh.append(make_box({0.7, 0.5, 0.6}), {{0.6, 0.5, 0.5}, Quaterniond::Identity()});
    mesh.append(make_box({0.3, 1.2, 0.3}), {{-0.8, -0.2, -0.4}, Quaterniond::Identity()});
    mesh.append(make_box({0.9, 0.1, 0.4}), {{1.6, -0.6, 0}, Quaterniond::Identity()});
    return model_of("flat-box", mesh);
  }();
  return model;
}

std::shared_ptr<const TargetModel> cylinder() {
  static const auto model = model_of("cylinder", make_cylinder(0.6, 2, 48));
  return model;
}

std::shared_ptr<const TargetModel> cube() {
  static const auto model = model_of("cube", make_box({1.5, 1.5, 1.5}));
  return model;
}

bool is_right(const TargetModel& model, const Pose& pose, const Pose& truth) {
  return model.symmetries.angle_between(pose, truth) < radians(5) &&
         model.symmetries.distance(pose, truth) < 0.05 * model.target.length;
}

/// A scan of a window around the target with about so many returns from it.
std::vector<RawBeam> scan_of(const TargetModel& model, ScanMaker& lidar, int returns) {
  ScanMaker probe(model.target.mesh);
  probe.beam = lidar.beam;
  probe.pose = lidar.pose;
  const std::vector<RawBeam> look = probe.sweep(around(model, lidar.pose, 2000));
  const auto hits = std::count_if(look.begin(), look.end(),
                                  [](const RawBeam& b) { return b.status == BeamStatus::hit; });
  const double beams = static_cast<double>(returns) * static_cast<double>(look.size());
  return lidar.sweep(
      around(model, lidar.pose, static_cast<int>(beams / static_cast<double>(hits))));
}

struct Tally {
  int right = 0;
  int ambiguous_with_truth = 0;
  int silent_error = 0;
  int nothing = 0;
};

void count(const TargetModel& model, const AcquisitionResult& result, const Pose& truth,
           Tally& tally) {
  REQUIRE(result.hypotheses.size() <= 4);
  const auto right = [&](const Hypothesis& h) { return is_right(model, h.pose, truth); };
  if (result.status == Status::found) {
    CHECK(result.reason.empty());
    ++(right(result.hypotheses.front()) ? tally.right : tally.silent_error);
  } else {
    CHECK_FALSE(result.reason.empty());
    const bool open = result.status == Status::ambiguous &&
                      std::any_of(result.hypotheses.begin(), result.hypotheses.end(), right);
    ++(open ? tally.ambiguous_with_truth : tally.nothing);
  }
}

/// spoil: what else happens to the scan.
template <class Spoil>
Tally acquire(const TargetModel& model, int trials, int returns, const Spoil& spoil) {
  const HypothesisAcquisition acquisition(model, beam_model, options);
  Random random(17, "attitudes of " + model.target.name);
  Tally tally;
  for (int i = 0; i < trials; ++i) {
    ScanMaker lidar(model.target.mesh, static_cast<std::uint64_t>(i) + 1);
    lidar.beam = beam_model;
    lidar.pose = random_pose(random, 5);
    const Pose truth = lidar.pose;
    std::vector<RawBeam> raw = scan_of(model, lidar, returns);
    spoil(raw, random);
    count(model, acquisition.acquire(preprocess(raw, {0.5, 15}, beam_model)), truth, tally);
  }
  return tally;
}

void as_it_is(std::vector<RawBeam>&, Random&) {}

}  // namespace

TEST_CASE("Shapes with and without a long axis are found in any attitude by 1000 returns") {
  for (const auto& model : {replica_model(), flat_box()}) {
    const Tally tally = acquire(*model, 30, 1000, as_it_is);
    CAPTURE(model->target.name, tally.right, tally.ambiguous_with_truth);
    CHECK(tally.silent_error == 0);
    CHECK(tally.right + tally.ambiguous_with_truth >= 29);
    CHECK(tally.right >= 27);
  }
}

TEST_CASE("A cube and a cylinder are found; poses that are equal are one") {
  for (const auto& model : {cube(), cylinder()}) {
    const Tally tally = acquire(*model, 20, 500, as_it_is);
    CAPTURE(model->target.name, tally.right, tally.ambiguous_with_truth);
    CHECK(tally.silent_error == 0);
    CHECK(tally.right >= 19);
  }
}

TEST_CASE("A turn that is observable only at the edges of thin panels is hardly ever wrong") {
  // A tank whose panels are seen from their side.
  Mesh mesh = make_cylinder(0.2, 0.8, 30);
  for (const double side : {-1.0, 1.0}) {
    mesh.append(make_box({0.4, 1.1, 0.004}), {{0, 0.95 * side, -0.2}, Quaterniond::Identity()});
  }
  const auto model = model_of("tank-with-panels", mesh);
  const HypothesisAcquisition acquisition(*model, beam_model, options);
  Random random(11, "panels from their side");
  Tally tally;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const double around = random.uniform(0, radians(360));
    const double above = random.uniform(-radians(12), radians(12));
    const Vector3d viewer(std::cos(above) * std::cos(around), std::cos(above) * std::sin(around),
                          std::sin(above));
    ScanMaker lidar(mesh, i + 1);
    lidar.beam = beam_model;
    lidar.pose = {{0, 0, 5},
                  rotation_from_vector({0, 0, random.uniform(0, radians(360))}) *
                      Quaterniond::FromTwoVectors(viewer, -Vector3d::UnitZ())};
    const auto scan = preprocess(scan_of(*model, lidar, 1500), {0.5, 15}, beam_model);
    count(*model, acquisition.acquire(scan), lidar.pose, tally);
  }
  CAPTURE(tally.right, tally.ambiguous_with_truth, tally.nothing);
  CHECK(tally.silent_error <= 1);
  CHECK(tally.right + tally.ambiguous_with_truth >= 197);
}

TEST_CASE("A third of the returns may come from something else") {
  const auto outliers = [](std::vector<RawBeam>& raw, Random& random) {
    const auto hits = std::count_if(raw.begin(), raw.end(),
                                    [](const RawBeam& b) { return b.status == BeamStatus::hit; });
    // so many of the beams that they are three of ten returns, although some hide the target's
    const double share = 0.4 * static_cast<double>(hits) / static_cast<double>(raw.size());
    for (RawBeam& b : raw) {
      if (random.uniform() > share) continue;
      b.status = BeamStatus::hit;
      b.range = random.uniform(3, 8);
    }
  };
  const Tally tally = acquire(*flat_box(), 20, 800, outliers);
  CAPTURE(tally.right, tally.ambiguous_with_truth, tally.nothing);
  CHECK(tally.silent_error == 0);
  CHECK(tally.right >= 14);
}

TEST_CASE("Without beams that met nothing, the returns alone are enough") {
  const auto hits_only = [](std::vector<RawBeam>& raw, Random&) {
    std::erase_if(raw, [](const RawBeam& b) { return b.status != BeamStatus::hit; });
  };
  const Tally tally = acquire(*flat_box(), 20, 1000, hits_only);
  CAPTURE(tally.right, tally.ambiguous_with_truth, tally.nothing);
  CHECK(tally.silent_error == 0);
  CHECK(tally.right + tally.ambiguous_with_truth >= 19);
}

TEST_CASE("Something else is seldom taken for the target") {
  const Mesh others[] = {make_box({3, 1.2, 0.6}), make_cylinder(0.5, 3, 24), make_box({1, 1, 1}),
                         make_box({8, 8, 0.1})};
  int scans = 0;
  int found = 0;
  for (const auto& model : {replica_model(), flat_box()}) {
    const HypothesisAcquisition acquisition(*model, beam_model, options);
    Random random(3, "others");
    for (const Mesh& other : others) {
      for (int i = 0; i < 5; ++i) {
        ScanMaker lidar(other, static_cast<std::uint64_t>(i));
        lidar.beam = beam_model;
        lidar.pose = random_pose(random, 6);
        const AcquisitionResult result =
            acquisition.acquire(preprocess(lidar.sweep(full_view(5000)), {}, beam_model));
        ++scans;
        if (result.status == Status::found) ++found;
      }
    }
  }
  // Faces as large as the target's are the target, half turned away or with parts elsewhere.
  CAPTURE(scans, found);
  CHECK(10 * found <= scans);
}

TEST_CASE("What one scan leaves open, windows chosen for it decide") {
  // A mark on one corner of a face: four poses that differ in nothing else.
  Mesh mesh = make_box({1.5, 1.5, 1.5});
  mesh.append(make_box({0.2, 0.2, 0.12}), {{0.5, 0.5, 0.81}, Quaterniond::Identity()});
  const auto model = model_of("marked-cube", mesh);
  const HypothesisAcquisition acquisition(*model, beam_model, options);
  ScanMaker lidar(mesh, 3);
  lidar.beam = beam_model;
  lidar.pose = {{0, 0, 5},
                rotation_from_vector({radians(180), 0, 0}) * rotation_from_vector({0.3, 0.2, 0.1})};
  const Pose truth = lidar.pose;
  std::vector<Hypothesis> open(4);
  for (std::size_t i = 0; i < open.size(); ++i) {
    const Quaterniond turn = rotation_from_vector({0, 0, radians(90.0 * static_cast<double>(i))});
    open[i].pose = truth * Pose{Vector3d::Zero(), turn};
    open[i].probability = 0.25;
  }
  std::swap(open[0], open[2]);
  const std::vector<Window> windows =
      discriminating_windows(*model, open, {}, 400, beam_model, 0.004);
  REQUIRE_FALSE(windows.empty());
  REQUIRE(windows.size() <= 4);
  const AcquisitionResult closed =
      acquisition.acquire(preprocess(lidar.sweep(windows), {}, beam_model), open);
  CAPTURE(closed.reason);
  REQUIRE(closed.status == Status::found);
  CHECK(is_right(*model, closed.hypotheses.front().pose, truth));
  CHECK(discriminating_windows(*model, closed.hypotheses, {}, 400, beam_model, 0.004).empty());
}

TEST_CASE("Scans with nothing in them acquire nothing, each with a reason") {
  const auto model = flat_box();
  const HypothesisAcquisition acquisition(*model, beam_model, options);
  std::vector<RawBeam> misses(3000);
  for (std::size_t i = 0; i < misses.size(); ++i) {
    misses[i].azimuth = 1e-4 * static_cast<double>(i);
  }
  std::vector<RawBeam> one = misses;
  one[7].status = BeamStatus::hit;
  one[7].range = 5;
  const std::vector<RawBeam> same(3000, one[7]);
  for (const auto& raw : {std::vector<RawBeam>{}, misses, one, same}) {
    const AcquisitionResult result = acquisition.acquire(preprocess(raw, {}, beam_model));
    CHECK(result.status == Status::not_found);
    CHECK_FALSE(result.reason.empty());
  }
}
