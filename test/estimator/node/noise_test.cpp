// SPDX-License-Identifier: BSD-3-Clause
// A LIDAR that is worse, better or slower than its profile states.
#include "test/catch.h"
#include "test/estimator/node/fold_fixture.h"

using namespace berth;
using namespace berth::estimator;
using Command = estimator_command_t;
using State = estimator_state_t;
using Estimate = pose_estimate_t;

namespace {

double noise_factor(const estimator_diagnostics_t& d) {
  for (std::size_t i = 0; i < d.names.size(); ++i) {
    if (d.names[i] == "noise_factor") return d.values[i];
  }
  FAIL("no noise_factor in the diagnostics");
  return 0;
}

int beams_in(const scan_request_t& request) {
  int count = 0;
  for (const scan_window_t& w : request.windows) count += w.count;
  return count;
}

}  // namespace

TEST_CASE("The noise is learnt from the returns, found and followed at a half and three times it") {
  double nominal_sigma = 0;
  for (const double factor : {1.0, 0.5, 3.0}) {
    INFO(factor << " times the nominal noise");
    EstimatorSetup setup = test_setup();
    // The mesh is the surface and ranges are not biased, as here: else the pose's sigma is of that.
    setup.options.likelihood_tracking.bare_surface_sigma_m = 1e-4;
    setup.lidar.beam.range_bias_m = 0;
    Loopback run(std::move(setup));
    run.lidar.footprint = true;  // as in the profile
    run.lidar.pose = start_pose;
    run.lidar.beam.range_sigma_m *= factor;
    run.lidar.beam.azimuth_sigma_rad *= factor;
    run.lidar.beam.elevation_sigma_rad *= factor;
    run.send(command(Command::ACQUIRE, 1, 1));
    for (int i = 0; i < 10; ++i) REQUIRE(run.scan_once());
    REQUIRE(run.estimator.state().mode == State::TRACKING);
    const Estimate& e = run.last();
    CHECK(e.status == Estimate::OK);
    CHECK(noise_factor(run.output.durations.back()) == Approx(factor).epsilon(0.15));
    const auto reports =
        std::count(run.output.notes.begin(), run.output.notes.end(), "noise-differs");
    CHECK(reports == (factor == 1 ? 0 : 1));
    const double sigma = std::sqrt(e.covariance[14]);  // along the boresight
    if (factor == 1) nominal_sigma = sigma;
    CHECK(sigma == Approx(factor * nominal_sigma).epsilon(0.4));
    CHECK(distance(pose_of(e), start_pose) < 0.01 * factor);
  }
}

TEST_CASE("Noise that grows while the target is tracked does not lose it") {
  Loopback run;
  run.lidar.pose = start_pose;
  run.send(command(Command::ACQUIRE, 1, 1));
  for (int i = 0; i < 5; ++i) REQUIRE(run.scan_once());
  run.lidar.beam.range_sigma_m *= 3;
  for (int i = 0; i < 5; ++i) REQUIRE(run.scan_once());
  CHECK(run.estimator.state().mode == State::TRACKING);
  CHECK(run.last().status == Estimate::OK);
  CHECK(noise_factor(run.output.durations.back()) == Approx(3).epsilon(0.15));
}

TEST_CASE("Learnt noise is bounded, and moves little with few returns") {
  BeamModel nominal;
  nominal.range_sigma_m = 0.01;
  NoiseScale noise(nominal, {0.3, 5});
  noise.start_at(100);
  CHECK(noise.factor() == 5);
  CHECK(noise.beam().range_sigma_m == Approx(0.05));
  noise.reset();
  CHECK(noise.beam().range_sigma_m == nominal.range_sigma_m);
  CHECK_FALSE(noise.update(9, 50));  // too few to be sure
  CHECK(noise.factor() < 2);
  noise.reset();
  CHECK(noise.update(9, 1000));
  CHECK(noise.factor() == Approx(3));
  CHECK_FALSE(noise.update(0, 1000));  // a method that does not know
  CHECK(noise.factor() == Approx(3));
  NoiseScale constant(nominal, {1, 1});
  CHECK_FALSE(constant.update(9, 1000));
  CHECK(constant.factor() == 1);
}

TEST_CASE("A slow scanner gets fewer beams a scan, unless a command states how many") {
  EstimatorSetup setup = test_setup();
  setup.lidar.rate_hz = 1000;
  const auto max_beams = static_cast<int>(1000 * setup.options.max_scan_time_s);
  Loopback run(std::move(setup));
  run.lidar.pose = start_pose;
  run.lidar.rate_hz = 1000;
  run.send(command(Command::ACQUIRE, 1, 1));
  for (int i = 0; i < 4; ++i) REQUIRE(run.scan_once());
  REQUIRE(run.estimator.state().mode == State::TRACKING);
  CHECK(run.last().status == Estimate::OK);
  CHECK(beams_in(run.output.requests.back()) <= 1.2 * max_beams);
  estimator_command_t more = command(Command::TRACK, 2, 1);
  more.first_scan_id = run.estimator.state().scan_id + 1;
  more.returns_per_scan = 1000;
  run.send(more);
  REQUIRE(run.scan_once());
  CHECK(beams_in(run.output.requests.back()) > 1.5 * max_beams);
}
