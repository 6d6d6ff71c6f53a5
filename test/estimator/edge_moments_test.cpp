// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/tracking/edge_moments.h"

#include <cmath>

#include "estimator/tracking/edge_nodes.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::estimator;

namespace {

constexpr double range = 8;
constexpr double angle_sigma = 1e-3;
constexpr double known = 0.002;  // m, standard deviation of the displacement

/// A bar that stands across the beam, from here to there to the right of where it was sent.
Mesh bar(double from, double to) {
  Mesh mesh;
  mesh.append(make_box({to - from, 2, 0.002}),
              Pose{{0.5 * (from + to), 0, range + 0.001}, Quaterniond::Identity()});
  return mesh;
}

/// Mean displacement by the likelihood of a beam that returned from such a bar, over beams of all
/// turns of the nodes: its mean and standard deviation; and how many nodes explain it.
struct Told {
  double mean = 0;
  double scatter = 0;
  double nodes = 0;
};
Told told(const RayCaster& bar, std::size_t nodes) {
  constexpr int beams = 256;
  Beam beam;
  beam.direction = Vector3d::UnitZ();
  beam.range = range;
  EdgeView view;
  view.beam = &beam;
  view.angle = angle_sigma * angle_sigma * Eigen::Matrix2d::Identity();
  view.range_variance = 1e-4;
  view.cavity = known * known * Matrix3d::Identity();
  Told all;
  double squares = 0;
  for (std::uint32_t i = 0; i < beams; ++i) {
    REQUIRE(view.cast(bar, 2 * range, range, edge_nodes(i, nodes)));
    const EdgeMoments moments = edge_moments(view, {}, 0.1);
    all.mean += moments.mean.x() / beams;
    squares += moments.mean.x() * moments.mean.x() / beams;
    all.nodes += moments.nodes / beams;
  }
  all.scatter = std::sqrt(squares - all.mean * all.mean);
  return all;
}

double density(double x) { return std::exp(-0.5 * x * x) / std::sqrt(2 * radians(180)); }
double below(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

}  // namespace

TEST_CASE(
    "What a beam from a narrow bar says is right, and the finer its nodes the less it scatters") {
  const double from = 0.006;
  const double to = 0.011;
  const RayCaster caster(bar(from, to));
  // Where on the target the beam went, less the displacement: normal, cut off at the bar's ends.
  const double spread = std::hypot(angle_sigma * range, known);
  const double share = below(to / spread) - below(from / spread);
  const double place = spread * (density(from / spread) - density(to / spread)) / share;
  const double expected = -known * known / (spread * spread) * place;

  const Told few = told(caster, 32);
  const Told many = told(caster, 128);
  CHECK(few.mean == Approx(expected).epsilon(0.1));
  CHECK(many.mean == Approx(expected).epsilon(0.05));
  CHECK(many.scatter < 0.6 * few.scatter);
  CHECK(few.nodes == Approx(32 * share).epsilon(0.2));
  CHECK(few.nodes < 8);
}

TEST_CASE(
    "A beam that may as well have met a face as passed it is explained by half of its nodes") {
  const RayCaster half(bar(0, 2));
  CHECK(told(half, 16).nodes == Approx(8).epsilon(0.1));
}
