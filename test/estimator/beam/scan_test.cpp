// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/beam/scan.h"

#include <cmath>

#include "test/catch.h"

using namespace berth;
using namespace berth::estimator;

TEST_CASE("Every beam is kept as a point, kept as evidence of free space, or counted as dropped") {
  const double nan = std::nan("");
  std::vector<RawBeam> raw = {
      {10, 5, 0.1, 0.2, BeamStatus::hit},    {20, 5, 0, 0, BeamStatus::hit},
      {30, 2, 0, 0, BeamStatus::hit},        {40, 9, 0, 0, BeamStatus::hit},
      {50, 0, 0, 0, BeamStatus::miss},       {60, 0, 0.1, 0, BeamStatus::too_far},
      {70, 0, 0, 0, BeamStatus::too_near},   {80, 0, 0, 0, BeamStatus::saturated},
      {90, nan, 0, 0, BeamStatus::hit},      {100, 0, 0, 0, BeamStatus::hit},
      {110, -3, 0, 0, BeamStatus::hit},      {120, 5, nan, 0, BeamStatus::hit},
      {130, 1e9, 0, 0, BeamStatus::hit},     {140, 0, 0, INFINITY, BeamStatus::miss},
      {150, INFINITY, 0, 0, BeamStatus::hit}};
  const PreprocessedScan scan = preprocess(raw, {3, 7}, {});
  CHECK(scan.received == 15);
  CHECK(scan.points.size() == 2);
  CHECK(scan.nearer == 1);
  CHECK(scan.farther == 1);
  CHECK(scan.misses == 2);
  CHECK(scan.too_near == 1);
  CHECK(scan.saturated == 1);
  CHECK(scan.invalid == 7);
  CHECK(scan.beams.size() == 6);
  CHECK(static_cast<int>(scan.beams.size()) + scan.invalid + scan.saturated + scan.too_near +
            scan.repeated ==
        scan.received);
  CHECK(scan.utime_first == 10);
  CHECK(scan.utime_last == 20);
  CHECK(scan.utime_mean == 15);
  // azimuth to the right (x), elevation up (-y)
  CHECK(scan.points[0].norm() == Approx(5));
  CHECK(scan.points[0].x() == Approx(5 * std::cos(0.2) * std::sin(0.1)));
  CHECK(scan.points[0].y() == Approx(-5 * std::sin(0.2)));
  CHECK(scan.beams[scan.beam_of_point[1]].utime == 20);
}

TEST_CASE("Times out of order give the same mean") {
  const std::vector<RawBeam> raw = {{1000, 5, 0, 0, BeamStatus::hit},
                                    {400, 5, 0.1, 0, BeamStatus::hit},
                                    {1600, 5, 0.2, 0, BeamStatus::hit}};
  const PreprocessedScan scan = preprocess(raw, {}, {});
  CHECK(scan.utime_first == 400);
  CHECK(scan.utime_last == 1600);
  CHECK(scan.utime_mean == 1000);
}

TEST_CASE("A beam that repeats another, whenever it comes, is one beam") {
  const std::vector<RawBeam> once = {{10, 5, 0.1, 0.2, BeamStatus::hit},
                                     {20, 5, 0.1, 0.3, BeamStatus::hit},
                                     {30, 6, 0.1, 0.2, BeamStatus::hit},
                                     {40, 9, 0.1, 0.2, BeamStatus::hit},
                                     {50, 0, 0.1, 0.2, BeamStatus::miss}};
  std::vector<RawBeam> raw = once;
  for (RawBeam beam : once) {
    beam.utime += 1000;
    raw.push_back(beam);
    raw.push_back(beam);
  }
  const PreprocessedScan scan = preprocess(raw, {3, 7}, {});
  CHECK(scan.received == 15);
  CHECK(scan.repeated == 10);
  CHECK(scan.points.size() == 3);
  CHECK(scan.farther == 1);
  CHECK(scan.misses == 1);
  CHECK(scan.beams.size() == 5);
  CHECK(scan.utime_mean == preprocess(once, {3, 7}, {}).utime_mean);
}

TEST_CASE("Second returns count where the scanner is configured to report them") {
  RawBeam both{10, 5, 0.1, 0.2, BeamStatus::hit, 0.01, 300, 6.5, 0.02, 200};
  RawBeam far = both;
  far.azimuth = 0.2;
  far.second_range = 9;
  RawBeam broken = both;
  broken.azimuth = 0.3;
  broken.second_range = std::nan("");
  const std::vector<RawBeam> raw = {both, far, broken};
  BeamModel beam_model;
  CHECK(preprocess(raw, {3, 7}, beam_model).beams.size() == 3);
  beam_model.second_returns = true;
  const PreprocessedScan scan = preprocess(raw, {3, 7}, beam_model);
  REQUIRE(scan.beams.size() == 5);
  CHECK(scan.beams[1].direction == scan.beams[0].direction);
  CHECK(scan.beams[1].range == 6.5);
  CHECK(scan.beams[1].range_sigma == 0.02);
  CHECK(scan.beams[1].intensity == 200);
  CHECK(scan.points.size() == 4);
  CHECK(scan.farther == 1);
  CHECK(scan.invalid == 1);
  CHECK(scan.received == 6);
}

TEST_CASE("An empty scan is an empty scan") {
  const PreprocessedScan scan = preprocess({}, {}, {});
  CHECK(scan.received == 0);
  CHECK(scan.points.empty());
  CHECK(scan.utime_mean == 0);
}
