// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/beam_model.h"

#include "common/core/config.h"
#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;

TEST_CASE("azimuth turns right and elevation up, both zero on the boresight") {
  CHECK(beam_direction(0, 0).isApprox(Vector3d::UnitZ()));
  CHECK(beam_direction(0.1, 0).x() > 0);
  CHECK(beam_direction(0, 0.1).y() < 0);
  Random random(1, "beams");
  for (int i = 0; i < 100; ++i) {
    const double azimuth = random.uniform(-3, 3);
    const double elevation = random.uniform(-1.5, 1.5);
    double a = 0;
    double e = 0;
    beam_angles(2.5 * beam_direction(azimuth, elevation), a, e);
    CHECK(a == Approx(azimuth).margin(1e-12));
    CHECK(e == Approx(elevation).margin(1e-12));
  }
}

TEST_CASE("slope turns angle noise into range noise") {
  BeamModel beam;
  CHECK(beam.range_variance(5, 0) == Approx(1e-4));
  CHECK(beam.range_variance(100, radians(45)) == Approx(1e-4 + 1e-4));
  CHECK(beam.range_variance(5, radians(90)) == beam.range_variance(5, radians(89)));
  CHECK(beam.footprint(5) == Approx(0.01285));
}

TEST_CASE("a beam section is read strictly") {
  const BeamModel beam =
      read_beam_model(Config::parse("range_sigma: 2 cm\nazimuth_sigma: 1 mrad\n", "beam.yaml"));
  CHECK(beam.range_sigma_m == Approx(0.02));
  CHECK(beam.azimuth_sigma_rad == Approx(1e-3));
  CHECK(beam.elevation_sigma_rad == Approx(1e-4));
  using Catch::Matchers::Contains;
  CHECK_THROWS_WITH(read_beam_model(Config::parse("range_sgima: 2 cm\n", "beam.yaml")),
                    Contains("did you mean 'range_sigma'"));
  CHECK_THROWS_WITH(read_beam_model(Config::parse("divergence: -1 mrad\n", "beam.yaml")),
                    Contains("beam.yaml:1") && Contains("of at least 0"));
  CHECK_THROWS_WITH(read_beam_model(Config::parse("range_max: 2 m\n", "beam.yaml")),
                    Contains("range_max"));
}
