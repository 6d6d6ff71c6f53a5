// SPDX-License-Identifier: BSD-3-Clause
/// What must hold of any method, end to end: acquisition, refinement and the judge of both.
#include <Eigen/LU>
#include <algorithm>

#include "test/catch.h"
#include "test/estimator/single_scan_fixture.h"

using namespace berth;
using namespace berth::estimator;
using Status = SingleScanResult::Status;

namespace {

std::shared_ptr<const TargetModel> compiled(const char* name, const Mesh& mesh) {
  Target target;
  target.name = name;
  target.mesh = mesh;
  target.hash = content_hash(mesh);
  target.length = bounding_box(mesh).size().maxCoeff();
  return compile_target_model(target, {});
}

template <class T>
void shuffle(std::vector<T>& items, Random& random) {
  for (std::size_t i = items.size(); i-- > 1;) std::swap(items[i], items[random.bits() % (i + 1)]);
}

/// The same pose, as near as two searches over the same data come: of the length, and rad.
void check_same(const SingleScanFixture& f, const SingleScanResult& result, const Pose& expected) {
  REQUIRE(result.status == Status::ok);
  const Pose& pose = result.candidates.front().pose;
  CHECK((pose * f.model->centre - expected * f.model->centre).norm() <
        0.002 * f.model->target.length);
  CHECK(angle_between(pose, expected) < radians(0.3));
}

struct Tally {
  int right = 0;
  int unsure = 0;
  int wrong = 0;
};

/// Estimates the replica at random attitudes, each scan spoilt first.
template <class Spoil>
Tally estimate_spoilt(int trials, int beams, Spoil spoil) {
  SingleScanFixture f;
  Random random(21, "spoilt");
  Tally tally;
  for (int i = 0; i < trials; ++i) {
    f.truth = random_pose(random, 6);
    std::vector<RawBeam> scan = f.scan(beams, static_cast<std::uint64_t>(i) + 1);
    spoil(scan, random);
    const SingleScanResult result = f.estimate(scan);
    if (result.status != Status::ok) {
      CHECK_FALSE(result.reason.empty());
      ++tally.unsure;
    } else {
      ++(f.silently_wrong(result) ? tally.wrong : tally.right);
    }
  }
  return tally;
}

}  // namespace

TEST_CASE("A cloud moved is a pose moved") {
  const SingleScanFixture f;
  const auto hits = hits_of(f.scan(4000));
  const SingleScanResult still = f.estimate(hits);
  REQUIRE(still.status == Status::ok);
  Random random(4, "motions");
  for (int i = 0; i < 4; ++i) {
    // turned in place or about the sensor: what hides what stays nearly as it was
    const Pose motion{random.normal_vector(0.2), random.rotation()};
    check_same(f, f.estimate(moved_beams(hits, motion)), motion * still.candidates.front().pose);
  }
}

TEST_CASE("Beams turned about the sensor, misses too, are a pose turned") {
  const SingleScanFixture f;
  const auto beams = f.scan(4000);
  const SingleScanResult still = f.estimate(beams);
  REQUIRE(still.status == Status::ok);
  Random random(5, "turns");
  for (int i = 0; i < 4; ++i) {
    const Pose turn{Vector3d::Zero(), random.rotation()};
    check_same(f, f.estimate(moved_beams(beams, turn)), turn * still.candidates.front().pose);
  }
}

TEST_CASE("A world ten times smaller or larger is no other world") {
  SingleScanFixture f;
  const SingleScanResult own = f.estimate(f.scan(4000));
  REQUIRE(own.status == Status::ok);
  const PoseCandidate& expected = own.candidates.front();
  const Pose truth = f.truth;
  for (const double scale : {0.1, 10.0}) {
    CAPTURE(scale);
    f.scale = scale;
    f.truth.position = scale * truth.position;
    f.beam_model.range_sigma_m = scale * BeamModel().range_sigma_m;
    f.beam_model.aperture_m = scale * BeamModel().aperture_m;
    const SingleScanResult result = f.estimate(f.scan(4000));
    CAPTURE(result.reason);
    REQUIRE(result.status == Status::ok);
    const PoseCandidate& found = result.candidates.front();
    // to less than the noise: rounding may take the search along other ways
    Pose pose = found.pose;
    pose.position /= scale;
    const Vector6d off = difference(expected.pose, pose);
    CHECK(off.dot(expected.covariance->inverse() * off) < 6);
    const double scaled_back = (*found.covariance)(0, 0) / (scale * scale);
    // so do the beams at edges that count
    const double per_expected = scaled_back / (*expected.covariance)(0, 0);
    CHECK(per_expected > 0.5);
    CHECK(per_expected < 2);
    const double turn_per_expected = (*found.covariance)(3, 3) / (*expected.covariance)(3, 3);
    CHECK(turn_per_expected > 0.5);
    CHECK(turn_per_expected < 2);
  }
}

TEST_CASE("The order of the points does not matter, nor that of their times") {
  const SingleScanFixture f;
  auto beams = f.scan(4000);
  const SingleScanResult sorted = f.estimate(beams);
  REQUIRE(sorted.status == Status::ok);
  Random random(6, "orders");
  std::vector<std::int64_t> times;
  for (const RawBeam& beam : beams) times.push_back(beam.utime);
  shuffle(times, random);
  for (std::size_t i = 0; i < beams.size(); ++i) beams[i].utime = times[i];
  check_same(f, f.estimate(beams), sorted.candidates.front().pose);
  shuffle(beams, random);
  check_same(f, f.estimate(beams), sorted.candidates.front().pose);
}

TEST_CASE("A cube and a cylinder: right but for their symmetry, or ambiguous") {
  const std::vector<std::pair<const char*, Mesh>> shapes = {
      {"cube", make_box({1, 1, 1})}, {"cylinder", make_cylinder(0.4, 1.5, 64)}};
  for (const auto& [name, mesh] : shapes) {
    SingleScanFixture f;
    f.model = compiled(name, mesh);
    Random random(8, name);
    for (int i = 0; i < 6; ++i) {
      CAPTURE(name, i);
      f.truth = random_pose(random, 5);
      const SingleScanResult result = f.estimate(f.scan(1500, static_cast<std::uint64_t>(i) + 1));
      CHECK_FALSE(f.silently_wrong(result));
      CHECK(result.reason.empty() == (result.status == Status::ok));
      if (result.status == Status::ok) CHECK(result.candidates.front().equal_poses > 1);
    }
  }
}

TEST_CASE("Half the target hidden") {
  const Tally tally = estimate_spoilt(20, 4000, [](std::vector<RawBeam>& scan, Random& random) {
    // a board before it, up to a line through its middle
    const double angle = random.uniform(0, radians(360));
    for (RawBeam& beam : scan) {
      if (std::cos(angle) * beam.azimuth + std::sin(angle) * beam.elevation < 0) continue;
      beam.status = BeamStatus::hit;
      beam.range = 2.5 + random.normal(0.01);
    }
  });
  CAPTURE(tally.right, tally.unsure);
  CHECK(tally.wrong == 0);
  CHECK(tally.right > 0);
}

TEST_CASE("Thirty per cent outliers") {
  const Tally tally = estimate_spoilt(20, 4000, [](std::vector<RawBeam>& scan, Random& random) {
    for (RawBeam& beam : scan) {
      if (beam.status == BeamStatus::hit && random.uniform() < 0.3)
        beam.range = random.uniform(2, 12);
    }
  });
  CAPTURE(tally.right, tally.unsure);
  CHECK(tally.wrong == 0);
}

TEST_CASE("Something else is never the target, whether searched for or tracked") {
  const SingleScanFixture f;
  Random random(9, "others");
  Mesh table;
  table.append(make_box({2.5, 0.1, 1.2}));
  for (const double x : {-1.1, 1.1}) {
    table.append(make_box({0.1, 0.9, 0.1}), {{x, 0.5, 0.5}, Quaterniond::Identity()});
  }
  const Mesh others[] = {make_box({3, 1.2, 0.6}), make_cylinder(0.5, 3, 24), make_box({8, 8, 0.1}),
                         table};
  for (const Mesh& other : others) {
    for (int i = 0; i < 4; ++i) {
      ScanMaker lidar(other, static_cast<std::uint64_t>(i) + 1);
      lidar.pose = random_pose(random, 6);
      const auto beams = lidar.sweep(full_view(6000));
      for (const auto& scan : {beams, hits_of(beams)}) {
        CAPTURE(i, scan.size());
        CHECK(f.estimate(scan).status != Status::ok);
        CHECK(f.estimate(scan, lidar.pose).status != Status::ok);
      }
    }
  }
}

TEST_CASE("Millions of returns") {
  const SingleScanFixture f;
  const auto hits = hits_of(f.scan(20000));
  Random random(10, "millions");
  std::vector<RawBeam> many;
  while (many.size() < 2000000) {
    for (RawBeam beam : hits) {
      beam.range += random.normal(0.002);
      many.push_back(beam);
    }
  }
  const SingleScanResult result = f.estimate(many);
  REQUIRE(result.status == Status::ok);
  CHECK(f.is_right(result.candidates.front().pose));
}
