// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/scan_pattern.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "test/catch.h"

using namespace berth::lidar;

namespace {

const Pattern all_patterns[] = {Pattern::raster, Pattern::spiral, Pattern::rosette,
                                Pattern::lissajous};

Window window(Pattern pattern, int count) {
  Window w{0.1, -0.05, 0.2, 0.1, pattern, count, 0, ""};
  return w;
}

/// Largest distance from a point of the disc of 90 % of the window to its nearest beam, in units of
/// the mean spacing.
double largest_hole(const Window& w) {
  const ScanPattern pattern(w);
  double worst = 0;
  for (int i = 0; i < 400; ++i) {
    const double radius = 0.9 * std::sqrt((i + 0.5) / 400);
    const double angle = 2.399963 * i;
    const double x = w.azimuth + 0.5 * w.width * radius * std::cos(angle);
    const double y = w.elevation + 0.5 * w.height * radius * std::sin(angle);
    double nearest = 1e9;
    for (std::int64_t k = 0; k < pattern.size(); ++k) {
      const BeamAngles beam = pattern.beam(k);
      nearest = std::min(nearest, std::hypot(beam.azimuth - x, beam.elevation - y));
    }
    worst = std::max(worst, nearest);
  }
  return worst / beam_spacing(w);
}

}  // namespace

TEST_CASE("every pattern has the requested beams, all in the window") {
  for (const Pattern shape : all_patterns) {
    for (const int count : {1, 2, 3, 7, 50, 999, 1000}) {
      INFO("pattern " << static_cast<int>(shape) << ", " << count << " beams");
      const Window w = window(shape, count);
      const ScanPattern pattern(w);
      REQUIRE(pattern.size() == count);
      for (int i = 0; i < count; ++i) {
        const BeamAngles beam = pattern.beam(i);
        REQUIRE(std::abs(beam.azimuth - w.azimuth) <= 0.5 * w.width + 1e-12);
        REQUIRE(std::abs(beam.elevation - w.elevation) <= 0.5 * w.height + 1e-12);
      }
    }
  }
}

TEST_CASE("no pattern leaves a hole or fires the same beam twice") {
  for (const Pattern shape : all_patterns) {
    INFO("pattern " << static_cast<int>(shape));
    const Window w = window(shape, 1000);
    CHECK(largest_hole(w) < 2.5);
    const ScanPattern pattern(w);
    std::set<std::pair<long, long>> places;
    for (int i = 0; i < 1000; ++i) {
      const BeamAngles beam = pattern.beam(i);
      places.emplace(std::lround(beam.azimuth * 1e6), std::lround(beam.elevation * 1e6));
    }
    CHECK(places.size() > 950);  // curves cross themselves now and then
  }
}

TEST_CASE("a raster by spacing keeps it and sweeps to and fro from the top") {
  Window w{0, 0, 0.02, 0.01, Pattern::raster, 0, 0.001, ""};
  const ScanPattern pattern(w);
  REQUIRE(pattern.size() == 20 * 10);
  CHECK(pattern.beam(0).elevation > pattern.beam(199).elevation);
  CHECK(pattern.beam(1).azimuth - pattern.beam(0).azimuth == Approx(0.001));
  CHECK(pattern.beam(20).azimuth == Approx(pattern.beam(19).azimuth));  // turns at the end of a row
  CHECK(pattern.beam(19).elevation - pattern.beam(20).elevation == Approx(0.001));
  CHECK(pattern.beam(21).azimuth < pattern.beam(20).azimuth);
}

TEST_CASE("a raster by count spreads odd counts evenly") {
  const ScanPattern pattern(window(Pattern::raster, 997));
  double previous = 1e9;
  std::vector<int> rows;
  for (int i = 0; i < 997; ++i) {
    const double elevation = pattern.beam(i).elevation;
    if (elevation < previous - 1e-9) rows.push_back(0);
    previous = elevation;
    ++rows.back();
  }
  const auto [min_row, max_row] = std::minmax_element(rows.begin(), rows.end());
  CHECK(*max_row - *min_row <= 1);
}

TEST_CASE("flat and point-like windows are swept too") {
  Window line{0, 0, 0.1, 0, Pattern::raster, 11, 0, ""};
  CHECK(ScanPattern(line).size() == 11);
  CHECK(ScanPattern(line).beam(10).azimuth > 0.04);
  Window upright{0, 0, 0, 0.1, Pattern::raster, 11, 0, ""};
  CHECK(ScanPattern(upright).beam(0).elevation > 0.04);
  Window stare{0.2, 0.1, 0, 0, Pattern::raster, 5, 0, ""};
  CHECK(ScanPattern(stare).beam(4).azimuth == 0.2);
  Window one{0, 0, 0.001, 0.001, Pattern::spiral, 0, 1, ""};
  CHECK(ScanPattern(one).size() == 1);
}
