// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/limits.h"

#include <limits>

#include "drivers/lidar/protocol.h"
#include "test/catch.h"
#include "test/drivers/lidar/lidar_fixture.h"

using namespace berth;
using namespace berth::lidar;
using Catch::Matchers::Contains;

TEST_CASE("a request within the limits passes") {
  CHECK(check_windows(ilris(), {{0, 0, radians(40), radians(40), Pattern::raster, 3000, 0, ""}})
            .empty());
  CHECK(check_windows(ilris(), {{0, 0, 0, 0, Pattern::raster, 100, 0, ""}}).empty());  // a stare
}

TEST_CASE("what a LIDAR cannot do is refused by name") {
  const auto refusal = [](Window w) {
    const Window good{0, 0, 0.1, 0.1, Pattern::raster, 10, 0, ""};
    return check_windows(ilris(), {good, w});
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(refusal({radians(15), 0, radians(12), 0.1, Pattern::raster, 10, 0, ""}),
             Contains("window 1") && Contains("azimuth reaches to 21 deg") && Contains("20 deg"));
  CHECK_THAT(refusal({0, radians(-25), 0.1, 0.1, Pattern::raster, 10, 0, ""}),
             Contains("elevation reaches"));
  CHECK_THAT(refusal({0, 0, 0.1, 0.1, Pattern::raster, 0, 1e-5, ""}),
             Contains("10 urad apart") && Contains("minimum step is 20 urad"));
  CHECK_THAT(refusal({0, 0, 1e-4, 1e-4, Pattern::spiral, 1000, 0, ""}), Contains("minimum step"));
  CHECK_THAT(refusal({0, 0, 0.1, 0.1, Pattern::raster, 0, 0, ""}),
             Contains("neither count nor spacing"));
  CHECK_THAT(refusal({0, 0, 0.1, 0.1, Pattern::raster, -1, 0, ""}), Contains("negative"));
  CHECK_THAT(refusal({0, 0, -0.1, 0.1, Pattern::raster, 1, 0, ""}), Contains("size is negative"));
  CHECK_THAT(refusal({nan, 0, 0.1, 0.1, Pattern::raster, 1, 0, ""}), Contains("not finite"));
  CHECK_THAT(refusal({0, 0, 0.1, 0.1, static_cast<Pattern>(7), 1, 0, ""}), Contains("pattern 7"));
  CHECK_THAT(refusal({0, 0, 0.6, 0.6, Pattern::raster, 0, 3e-5, ""}),
             Contains("beams, at most 1000000"));
  CHECK_THAT(check_windows(ilris(), {}), Contains("no window"));
  CHECK_THAT(check_windows(ilris(), std::vector<Window>(max_windows + 1)), Contains("501 windows"));
}

TEST_CASE("a profile is read strictly") {
  const LidarProfile profile = load_lidar_profile("config/lidars/ilris_3d.yaml");
  CHECK(profile.model == "ILRIS-3D");
  CHECK(profile.rate_hz == 2000);
  CHECK(profile.field_of_view_width == Approx(radians(40)));
  CHECK(profile.beam.range_min_m == 3);
}
