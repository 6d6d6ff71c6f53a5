// SPDX-License-Identifier: BSD-3-Clause
// Whether the judges of the benchmarks judge rightly.
#include "test/benchmarks/judge.h"

#include <cmath>

#include "common/core/ray_caster.h"
#include "test/benchmarks/reference_registration.h"
#include "test/benchmarks/statistics.h"
#include "test/catch.h"

namespace berth::benchmark {
namespace {

using Status = estimator::AcquisitionResult::Status;

Verdict verdict(Status status, const std::vector<Pose>& poses, double true_x) {
  return trials::verdict_on(status, poses,
                            [&](const Pose& pose) { return pose.position.x() == true_x; });
}

Pose at(double x) { return {{x, 0, 0}, Quaterniond::Identity()}; }

Vector6d drawn_from(const Matrix6d& factor, Random& random) {
  Vector6d unit;
  for (double& v : unit) v = random.normal();
  return factor * unit;
}

}  // namespace

TEST_CASE("an answer may be ambiguous, but not silently wrong", "[judge]") {
  CHECK(verdict(Status::found, {at(1)}, 1) == Verdict::right);
  CHECK(verdict(Status::found, {at(2), at(1)}, 1) == Verdict::silently_wrong);
  CHECK(verdict(Status::ambiguous, {at(2), at(1)}, 1) == Verdict::ambiguous_with_truth);
  CHECK(verdict(Status::ambiguous, {at(2), at(3)}, 1) == Verdict::ambiguous_without);
  CHECK(verdict(Status::not_found, {at(1)}, 1) == Verdict::lost);
  CHECK(verdict(Status::refused, {}, 1) == Verdict::lost);

  Tally tally;
  tally.add(Verdict::right, true);
  tally.add(Verdict::lost, true);
  tally.add(Verdict::lost, false);
  tally.add(Verdict::ambiguous_with_truth, true);
  CHECK(tally.trials == 4);
  CHECK(tally.lost == 2);
  CHECK(tally.lost_though_right == 1);
  CHECK(tally.cells().size() == Tally::columns().size());
}

TEST_CASE("errors drawn from a covariance are consistent with it", "[judge]") {
  Random random(8, "consistency");
  Matrix6d factor;
  for (int i = 0; i < 36; ++i) factor(i / 6, i % 6) = random.normal();
  const Matrix6d covariance = factor * factor.transpose();
  constexpr int draws = 20000;
  double sum = 0;
  int within = 0;
  int within_too_small = 0;
  for (int i = 0; i < draws; ++i) {
    const Vector6d error = drawn_from(factor, random);
    sum += normalised_error_squared(error, covariance);
    within += within_three_sigma(error, covariance) ? 1 : 0;
    within_too_small += within_three_sigma(error, covariance / 9) ? 1 : 0;
  }
  const Bounds band = mean_chi_square_band(draws, 6, 50);

  CAPTURE(sum / draws);
  CHECK(band.contains(sum / draws));
  CHECK(wilson(within, draws).contains(0.9973));
  CHECK(within_too_small < draws / 4);
  CHECK(std::isinf(normalised_error_squared(Vector6d::Zero(), Matrix6d::Zero())));
  CHECK_FALSE(within_three_sigma(Vector6d::Zero(), Matrix6d::Constant(std::nan(""))));
}

TEST_CASE("reliability distinguishes calibrated probabilities from overconfident ones", "[judge]") {
  Random random(4, "reliability");
  Reliability calibrated;
  Reliability overconfident;
  for (int i = 0; i < 20000; ++i) {
    const double p = random.uniform();
    const bool came_true = random.uniform() < p;
    calibrated.add(p, came_true);
    overconfident.add(1 - 0.1 * (1 - p), came_true);
  }
  CHECK(calibrated.calibration_error() < 0.02);
  CHECK(overconfident.calibration_error() > 0.3);
  int count = 0;
  for (const Reliability::Bin& bin : calibrated.bins()) {
    count += bin.count;
    CHECK(bin.stated() >= bin.low);
    CHECK(bin.stated() <= bin.high);
  }
  CHECK(count == 20000);
  overconfident.add(1, true);  // certainty has a bin, too
  calibrated.add(overconfident);
  CHECK(calibrated.bins().back().count > overconfident.bins().back().count);
  CHECK(std::isnan(Reliability().calibration_error()));
}

TEST_CASE("points for registration lie on the mesh, evenly by area", "[judge]") {
  const Mesh box = make_box({1, 1, 4});
  const RayCaster caster(box);
  int on_ends = 0;
  constexpr int count = 9000;
  const auto points = points_on(box, count, Random(5, "points"));
  REQUIRE(points.size() == count);
  for (const SurfacePoint& p : points) {
    REQUIRE((caster.nearest(p.position) - p.position).norm() < 1e-6);
    REQUIRE(std::abs(p.normal.norm() - 1) < 1e-12);
    // Its face's, of either sign: along it, the point is as far out as the box is.
    REQUIRE(std::abs(p.normal.dot(p.position)) ==
            Approx(std::abs(p.normal.z()) > 0.5 ? 2 : 0.5).margin(1e-9));
    on_ends += std::abs(p.normal.z()) > 0.5 ? 1 : 0;
  }
  CHECK(wilson(on_ends, count).contains(2.0 / 18));
}

}  // namespace berth::benchmark
