// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <fstream>

#include "common/clouds/cloud.h"
#include "common/clouds/ptx_cloud.h"
#include "common/clouds/xyz_cloud.h"
#include "common/core/beam_model.h"
#include "common/core/error.h"
#include "common/core/random.h"
#include "test/catch.h"
#include "test/core/temporary_directory.h"
#include "test/estimator/cloud_files.h"

using namespace berth;
using namespace berth::clouds;
using Catch::Contains;
using estimator::ptx_poses;
using estimator::ptx_text;

namespace {

Vector3d point_of(const CloudBeam& beam) {
  return beam.range * beam_direction(beam.azimuth, beam.elevation);
}

std::string ptx(const std::string& columns, const std::string& rows, const std::string& beams) {
  return columns + "\n" + rows + "\n" + ptx_poses + beams;
}

/// A scanner's grid with trembling beams and holes, and which way every beam went.
struct NoisyGrid {
  std::size_t columns = 160;
  std::size_t rows = 120;
  std::vector<Vector3d> points;
  std::vector<Vector3d> directions;

  /// turn: from the scanner's own axes to the file's.
  NoisyGrid(const Quaterniond& turn, double first_azimuth, double step) {
    Random random(5, "grid");
    for (std::size_t c = 0; c < columns; ++c) {
      for (std::size_t r = 0; r < rows; ++r) {
        const double azimuth = first_azimuth + step * static_cast<double>(c);
        const double elevation = 0.3 - step * static_cast<double>(r);
        directions.push_back(turn * beam_direction(azimuth, elevation));
        // a disc of returns off the middle, with drop-outs: whole columns and rows have none
        const double u = static_cast<double>(c) - 70;
        const double v = static_cast<double>(r) - 55;
        const bool hit = u * u + v * v < 40 * 40 && random.uniform() < 0.7;
        const Vector3d seen =
            turn * beam_direction(azimuth + random.normal(1e-4), elevation + random.normal(1e-4));
        points.push_back(hit ? Vector3d(random.uniform(4, 6) * seen) : Vector3d::Zero());
      }
    }
  }
};

/// Beams of a file and of the grid, side by side: the largest angle between a miss and the truth.
double worst_miss(const Cloud& cloud, const NoisyGrid& grid) {
  REQUIRE(cloud.beams.size() == grid.directions.size());
  double worst = 0;
  for (std::size_t i = 0; i < cloud.beams.size(); ++i) {
    const CloudBeam& beam = cloud.beams[i];
    REQUIRE(beam.hit != grid.points[i].isZero());
    if (beam.hit) continue;
    const Vector3d direction = beam_direction(beam.azimuth, beam.elevation);
    worst = std::max(worst, direction.cross(grid.directions[i]).norm());
    REQUIRE(direction.dot(grid.directions[i]) > 0);
  }
  return worst;
}

}  // namespace

TEST_CASE("XYZ: points come back as beams, whatever parts the columns") {
  const char* texts[] = {"1 2 3\n-4 5 6.5\n", "# made by hand\n1,2,3\r\n\r\n-4,5,6.5\r\n",
                         "1;2;3;77;x\n  -4\t+5 0.65e1 // last", "z y x\n3 2 1\n6.5 5 -4\n",
                         "//X Y Z R G B\n1 2 3 0 0 0\n-4 5 6.5 9 9 9\n"};
  for (const char* text : texts) {
    const Cloud cloud = parse_xyz(text, "a.xyz");
    CAPTURE(text);
    REQUIRE(cloud.beams.size() == 2);
    CHECK((point_of(cloud.beams[0]) - Vector3d(1, 2, 3)).norm() < 1e-12);
    CHECK((point_of(cloud.beams[1]) - Vector3d(-4, 5, 6.5)).norm() < 1e-12);
    CHECK(cloud.beams[0].hit);
    CHECK_FALSE(cloud.has_misses);
    CHECK_FALSE(cloud.has_times);
  }
}

TEST_CASE("XYZ: named columns give times and sigmas") {
  const Cloud seconds = parse_xyz(
      "# x y z intensity Time sigma\n1 2 3 9 1700000000.25 0.02\n1 2 3 9 1700000000 0\n", "a.xyz");
  CHECK(seconds.has_times);
  CHECK(seconds.has_sigmas);
  CHECK(seconds.beams[0].utime == 1700000000250000);
  CHECK(seconds.beams[1].utime == 1700000000000000);
  CHECK(seconds.beams[0].range_sigma == 0.02);
  CHECK(seconds.beams[1].range_sigma == 0);
  const Cloud us = parse_xyz("utime,x,y,z\n12,1,2,3\n", "a.csv");
  CHECK(us.beams[0].utime == 12);
  CHECK_FALSE(us.has_sigmas);
}

TEST_CASE("XYZ: rows that are no returns are dropped and counted") {
  const Cloud cloud = parse_xyz(
      "x y z sigma\n1 2 3 0.01\nnan 2 3 0.01\n1 inf 3 0.01\n0 0 0 0.01\n1 2 3 -1\n1 2 3 nan\n"
      "1e999 0 0 0\n1e300 1e300 0 0\n",
      "a.xyz");
  CHECK(cloud.counts.points == 8);
  CHECK(cloud.counts.hits == 1);
  CHECK(cloud.counts.not_finite == 5);
  CHECK(cloud.counts.at_sensor == 1);
  CHECK(cloud.counts.bad_sigma == 1);
  CHECK(cloud.beams.size() == 1);
}

TEST_CASE("XYZ: errors name the file, the line, what was found and what was expected") {
  const auto says = [](const char* text, const char* part) {
    CHECK_THROWS_WITH(parse_xyz(text, "d/a.xyz"), Contains(part));
    CHECK_THROWS_WITH(parse_xyz(text, "d/a.xyz"), Contains("d/a.xyz"));
  };
  says("1 2 3\n1 2\n", "a.xyz:2: found 2 columns, expected z in column 3");
  says("\n1 2 3\n1 2 three\n", "a.xyz:3: found 'three' for z, expected a number");
  says("1 2 3\nx y z\n", "a.xyz:2: found 'x' for x, expected a number");
  says("a b c\n1 2 3\n", "a.xyz:1: found neither");
  says("x y z time\n1 2 3\n", "a.xyz:2: found 3 columns, expected time in column 4");
  says("", "holds no point");
  says("# nothing\n\n", "holds no point");
  CHECK_THROWS_WITH(parse_xyz(std::string_view("\0\1\2", 3), "b.xyz"), Contains("binary"));
}

TEST_CASE("PTX: empty beams become misses whose directions are right to a milliradian") {
  // the sensor frame's own axes, and a surveyor's: z up, x forward; both across the rear too
  Matrix3d axes;
  axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  for (const Quaterniond& turn : {Quaterniond::Identity(), Quaterniond(axes)}) {
    for (const double first : {-0.4, 2.9}) {
      const NoisyGrid grid(turn, first, 0.004);
      const Cloud cloud = parse_ptx(ptx_text(grid.points, grid.rows), "a.ptx");
      CHECK(cloud.has_misses);
      CHECK(cloud.notes.empty());
      CHECK(cloud.counts.points == grid.points.size());
      CHECK(cloud.counts.hits + cloud.counts.misses == grid.points.size());
      CHECK(worst_miss(cloud, grid) < 1e-3);
    }
  }
}

TEST_CASE("PTX: what tells no direction gives no miss") {
  SECTION("a single return") {
    const Cloud cloud = parse_ptx(ptx("2", "2", "0 0 0 0\n0 0 0 0\n0 0 5 1\n0 0 0 0\n"), "a.ptx");
    CHECK(cloud.counts.hits == 1);
    CHECK(cloud.counts.undirected == 3);
    REQUIRE(cloud.notes.size() == 1);
    CHECK_THAT(cloud.notes[0], Contains("too few"));
  }
  SECTION("none at all") {
    const Cloud cloud = parse_ptx(ptx("2", "1", "0 0 0 0\n0 0 0 0\n"), "a.ptx");
    CHECK(cloud.beams.empty());
    CHECK(cloud.counts.undirected == 2);
  }
  SECTION("no grid: points in any order") {
    NoisyGrid grid(Quaterniond::Identity(), -0.3, 0.004);
    Random random(7, "shuffle");
    for (std::size_t i = grid.points.size() - 1; i > 0; --i) {
      std::swap(grid.points[i], grid.points[random.bits() % (i + 1)]);
    }
    const Cloud cloud = parse_ptx(ptx_text(grid.points, grid.rows), "a.ptx");
    CHECK(cloud.counts.misses == 0);
    REQUIRE(cloud.notes.size() == 1);
    CHECK_THAT(cloud.notes[0], Contains("no regular grid"));
  }
}

TEST_CASE("PTX: errors name the file, the line, what was found and what was expected") {
  const auto says = [](const std::string& text, const char* part) {
    CHECK_THROWS_WITH(parse_ptx(text, "d/a.ptx"), Contains(part));
    CHECK_THROWS_WITH(parse_ptx(text, "d/a.ptx"), Contains("d/a.ptx:"));
  };
  says("", "the file ends, expected the number of columns");
  says("2\n", "the file ends, expected the number of rows");
  says("two\n", "a.ptx:1: found 'two'");
  says("-3\n", "a.ptx:1: found '-3'");
  says("1.5\n", "a.ptx:1: found '1.5'");
  says("1 2 3\n", "a.ptx:1: found 3 columns, expected the number of columns");
  says("1\n1\n0 0\n", "a.ptx:3: found 2 columns, expected the scanner's position");
  says(ptx("1", "2", "0 0 5 1\n"), "the file ends after 1 beams, expected 1 columns of 2 beams");
  says(ptx("1", "1", "0 0 5 1\n0 0 5 1\n"), "a.ptx:12: found more than the 1 beams");
  says(ptx("1", "1", "0 0 5 1\n") + ptx("1", "1", "0 0 5 1\n"), "a.ptx:12: found a second scan");
  says(ptx("1", "1", "0 zero 5 1\n"), "a.ptx:11: found 'zero' for y");
  says(ptx("100000000", "100000000", "0 0 5 1\n"), "too short");
}

TEST_CASE("A file that is none of the formats, or not there, is an error by name") {
  const TemporaryDirectory directory;
  CHECK_THROWS_WITH(read_cloud(directory / "a.las"), Contains("a.las: found '.las', expected"));
  CHECK_THROWS_WITH(read_cloud(directory / "a.xyz"), Contains("a.xyz: no such file"));
  CHECK_THROWS_WITH(read_cloud(directory.path()), Contains("expected"));
  std::ofstream(directory / "UPPER.XYZ") << "1 2 3\n";
  CHECK(read_cloud(directory / "UPPER.XYZ").beams.size() == 1);
}
