// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>
#include <fstream>

#include "common/clouds/cloud.h"
#include "common/core/beam_model.h"
#include "common/core/error.h"
#include "common/core/random.h"
#include "test/catch.h"
#include "test/common/clouds/cloud_files.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::clouds;
using Catch::Contains;
using estimator::ptx_poses;
using estimator::ptx_text;

namespace {

Vector3d point_of(const CloudBeam& beam) {
  return beam.range * beam_direction(beam.azimuth, beam.elevation);
}

Cloud xyz(const std::string& text) { return parse_cloud(text, ".xyz", "d/a.xyz"); }
Cloud parse_ptx(const std::string& text, const std::string& file) {
  return parse_cloud(text, ".ptx", file);
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

TEST_CASE("XYZ: points come back as beams, whatever parts the columns and the decimals") {
  const std::string texts[] = {
      "1 2 3\n-4 5 6.5\n",
      "# made by hand\n1,2,3\r\n\r\n-4,5,6.5\r\n",
      "1;2;3;77;x\n  -4;+5;0.65e1;8;y // last\n",
      "z y x\n3 2 1\n6.5 5 -4\n",
      "//X Y Z R G B\n1 2 3 0 0 0\n-4 5 6.5 9 9 9\n",
      "1\t2\t3\n-4\t5\t6.5\n",
      "1|2|3\n-4|5|6.5\n",
      "\t1\t\t2\t3\n\t-4\t\t5\t6.5\n",                     // aligned with tabs
      "1 2 3\r-4 5 6.5\r",                                 // old Macintosh
      "2\n1 2 3 0 1 2 3\n-4 5 6.5 0 1 2 3\n",              // PTS: how many follow
      "//X Y Z\n2\n1 2 3\n-4 5 6.5\n",                     // CloudCompare
      "\xEF\xBB\xBF\"x\",\"y\",\"z\"\n1,2,3\n-4,5,6.5\n",  // a byte order mark, quotes
      "sep=;\nx;y;z\n1,0;2;3\n-4;5;6,5\n",                 // a spreadsheet's own
      "1,0 2,0 3,0\n-4 5 6,5\n",                           // decimal commas
      "1,0\t2,0\t3,0\n-4\t5\t6,5\n",
      "\"x\",\"y\",\"z\"\n\"1,0\",\"2,0\",\"3\"\n-4,5,\"6,5\"\n",
      "\"\" x y z\n\"0\" 1 2 3\n\"1\" -4 5 6.5\n",
      ",x,y,z\n0,1,2,3\n1,-4,5,6.5\n",                   // an index without a name
      "intensity,x,y,z,ring\n,1,2,3,0\n80,-4,5,6.5,\n",  // empty cells
      "x,y,z,\n1,2,3,\n-4,5,6.5,\n",                     // a trailing delimiter
      "X(m);Y [m];Z_m;note\n1;2;3;a b\n-4;5;6.5;\n",     // units
      "x (mm)\ty (cm)\tz (m)\n1000\t200\t3\n-4000\t500\t6.5\n",
      "X [mm] Y [mm] Z [mm]\n1000 2000 3000\n-4000 5000 6500\n",
      "Points_m_XYZ:0,Points_m_XYZ:1,Points_m_XYZ:2,laser_id\n1,2,3,0\n-4,5,6.5,1\n",
      "TIMESTAMP (ns), X1 (m), Y1 (m), Z1 (m)\n0, 1, 2, 3\n0, -4, 5, 6.5\n",
      "# x, y, z, intensity\n1 2 3 0\n-4 5 6.5 0\n",  // named otherwise than parted
      "% x y z of a scan\n1 2 3\n-4 5 6.5\n",
      "1 2 3\n-4 5 6.5\n\x1A",
  };
  for (const std::string& text : texts) {
    CAPTURE(text);
    const Cloud cloud = xyz(text);
    REQUIRE(cloud.beams.size() == 2);
    CHECK((point_of(cloud.beams[0]) - Vector3d(1, 2, 3)).norm() < 1e-12);
    CHECK((point_of(cloud.beams[1]) - Vector3d(-4, 5, 6.5)).norm() < 1e-12);
    CHECK(cloud.beams[0].hit);
    CHECK(cloud.counts.points == 2);
    CHECK_FALSE(cloud.has_misses);
    CHECK_FALSE(cloud.has_times);
  }
}

TEST_CASE("XYZ: UTF-16 is text") {
  for (const bool big : {false, true}) {
    std::string bytes = big ? "\xFE\xFF" : "\xFF\xFE";
    for (const char c : std::string_view("x\ty\tz\r\n1\t2\t3\r\n")) {
      bytes += big ? std::string{'\0', c} : std::string{c, '\0'};
    }
    CHECK((point_of(xyz(bytes).beams.at(0)) - Vector3d(1, 2, 3)).norm() < 1e-12);
  }
}

TEST_CASE("XYZ: times have the unit that their name implies") {
  const auto utime = [](const std::string& name, const std::string& time) {
    const Cloud cloud = xyz("x,y,z," + name + "\n1,2,3," + time + "\n1,2,4," + time + "\n");
    CAPTURE(name, time);
    REQUIRE(cloud.has_times);
    CHECK(cloud.notes.empty());
    return cloud.beams[0].utime;
  };
  CHECK(utime("time (s)", "1700000000.25") == 1700000000250000);
  CHECK(utime("utime", "12") == 12);
  CHECK(utime("Time_us", "12") == 12);
  CHECK(utime("timestamp [ns]", "12000") == 12);
  CHECK(utime("t_ms", "12.5") == 12500);
  CHECK(utime("\"GPS_time (\xC2\xB5s)\"", "12") == 12);
}

TEST_CASE("XYZ: without it, the unit is found from the values or not used; both are reported") {
  const auto read = [](const std::string& first, const std::string& second) {
    return xyz("x y z timestamp\n1 2 3 " + first + "\n1 2 4 " + second + "\n");
  };
  const std::pair<const char*, const char*> same[] = {
      {"1700000000.25", "1700000000.5"},
      {"1700000000250", "1700000000500"},
      {"1700000000250000", "1700000000500000"},
      {"1700000000250000000", "1700000000500000000"}};
  for (const auto& [first, second] : same) {
    const Cloud cloud = read(first, second);
    CAPTURE(first);
    REQUIRE(cloud.has_times);
    CHECK(cloud.beams[0].utime == 1700000000250000);
    CHECK(cloud.beams[1].utime == 1700000000500000);
    REQUIRE(cloud.notes.size() == 1);
    CHECK_THAT(cloud.notes[0], Contains("times are read as"));
  }
  CHECK(read("0.25", "0.5").beams[1].utime == 500000);

  const std::pair<const char*, const char*> unusable[] = {
      {"0", "99990000"}, {"0", "0"},
      {"5", "nan"},      {"5", "-1.#IND"},
      {"5", "1e300"},    {"12:00:01", "12:00:02"},
      {"0.5", "1e7"},    {"1600000000", "1600100000"}};
  for (const auto& [first, second] : unusable) {
    const Cloud cloud = read(first, second);
    CAPTURE(first, second);
    CHECK_FALSE(cloud.has_times);
    CHECK(cloud.counts.hits == 2);
    CHECK(cloud.beams[1].utime == 0);
    REQUIRE(cloud.notes.size() == 1);
    CHECK_THAT(cloud.notes[0], Contains("times are not used") && Contains("'timestamp'"));
  }
  CloudOptions ns;
  ns.us_per_time = 1e-3;
  const Cloud in_nanoseconds =
      parse_cloud("x y z timestamp\n1 2 3 0\n1 2 4 99990000\n", ".xyz", "a.xyz", ns);
  CHECK(in_nanoseconds.has_times);
  CHECK(in_nanoseconds.beams[1].utime == 99990);
}

TEST_CASE("XYZ: a sigma is used where it is informative") {
  const Cloud cloud = xyz("sigma,x,y,z\n0.02,1,2,3\n,1,2,3\n-1,1,2,3\nnan,1,2,3\n0,1,2,3\n");
  CHECK(cloud.has_sigmas);
  CHECK(cloud.counts.hits == 5);
  CHECK(cloud.beams[0].range_sigma == 0.02);
  for (std::size_t i = 1; i < 5; ++i) CHECK(cloud.beams[i].range_sigma == 0);
  REQUIRE(cloud.notes.size() == 1);
  CHECK_THAT(cloud.notes[0], Contains("'sigma' has no usable value for 3 of 5 points"));
  CHECK(xyz("x y z range_sigma_mm\n1 2 3 20\n").beams[0].range_sigma == 0.02);
}

TEST_CASE("XYZ: rows that are no returns are dropped and counted") {
  const Cloud cloud =
      xyz("1 2 3\nnan 2 3\n1 inf 3\n0 0 0\n-nan(ind) 2 3\n1 -1.#IND 3\n1.#QNAN 1.#INF 3\n"
          "1e999 0 0\n1e300 1e300 0\n1 NA 3\n#N/A 2 3\n1 2 #DIV/0!\n1e-999 0 0\n");
  CHECK(cloud.counts.points == 13);
  CHECK(cloud.counts.hits == 1);
  CHECK(cloud.counts.not_finite == 10);
  CHECK(cloud.counts.at_sensor == 2);
  CHECK(cloud.beams.size() == 1);
  CHECK(xyz("x,y,z\n1,,3\n,,\n1,2,3\n").counts.not_finite == 2);
}

TEST_CASE("XYZ: errors name the file, the line, what was found and what was expected") {
  const auto check_error = [](const std::string& text, const char* part) {
    CAPTURE(text);
    CHECK_THROWS_WITH(xyz(text), Contains(part) && Contains("d/a.xyz"));
  };
  check_error("1 2 3\n1 2\n", "a.xyz:2: found 2 columns, expected 3: as many as in line 1");
  check_error("1 2 3\n\n1 2 3 4\n", "a.xyz:3: found 4 columns, expected 3");
  check_error("1,2,3\n4,5,6\n7;8;9\n", "a.xyz:3: found 1 columns, expected 3");
  check_error("1,2,3\n4 5 6\n", "a.xyz:2: ");
  check_error("1 2\n3 4\n", "a.xyz:1: found 2 columns, expected x, y and z");
  check_error("\n1 2 3\n1 2 three\n", "a.xyz:3: found 'three' for z, expected a number");
  check_error("1 2 3\nx y z\n", "a.xyz:2: found 'x' for x, expected a number");
  check_error("1 2 3\n1 0x10 3\n", "a.xyz:2: found '0x10' for y");
  check_error("1.5 2 3\n1,5 2 3\n", "a.xyz:2: found '1,5' for x");
  check_error("1,5;2;3\n1.5;2;3\n", "a.xyz:2: found '1.5' for x");
  check_error("1.234,5;2;3\n", "nor a header in '1.234,5;2;3'");
  check_error("a b c\n1 2 3\n", "a.xyz:1: found neither");
  check_error("x y z time\n1 2 3\n", "a.xyz:2: found 3 columns, expected 4: as many are named");
  check_error("x y z\n1 2 3 4\n", "a.xyz:2: found 4 columns, expected 3");
  check_error("x,y,z\n-0,28,0,47,7,75\n", "a decimal comma");
  check_error("# n intensity x y z\n1 2 3 4\n", "a comment that names x, y and z otherwise");
  check_error("x,y,z,x\n1,2,3,4\n", "a.xyz:1: found two columns named 'x'");
  check_error("x (px),y,z\n1,2,3\n", "a.xyz:1: found the unit 'px' of column 'x', expected m, mm");
  check_error("3\n1 2 3\n1 2 4\n", "found 2 points, expected the 3 declared");
  check_error("1\n1 2 3\n1 2 4\n", "a.xyz:3: found 2 points, expected the 1 declared");
  check_error("1,234 5,678 9,012\n", "decimals or thousands");
  check_error("1,25,2,75,3,5\n-1,25,2,75,3,5\n", "halves of numbers");
  check_error("0,1,2,3\n1,4,5,6\n2,7,8,9\n", "the first column counts the lines");
  check_error(
      "x,y,z\n\xE2\x88\x92"
      "0.2,1,8\n",
      "a.xyz:2: found '???0.2' for x");
  check_error(",1,2,3\n,4,5,6\n", "a.xyz:1: x, y or z is empty in every line");
  check_error("", "holds no point");
  check_error("x,y,z\n", "holds no point");
  check_error("# nothing\n\n", "holds no point");
  check_error(std::string("\0\1\2", 3), "binary");
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

TEST_CASE("PTX: beams without a known direction give no miss") {
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
  const auto check_error = [](const std::string& text, const char* part) {
    CHECK_THROWS_WITH(parse_ptx(text, "d/a.ptx"), Contains(part));
    CHECK_THROWS_WITH(parse_ptx(text, "d/a.ptx"), Contains("d/a.ptx:"));
  };
  check_error("", "the file ends, expected the number of columns");
  check_error("2\n", "the file ends, expected the number of rows");
  check_error("two\n", "a.ptx:1: found 'two'");
  check_error("-3\n", "a.ptx:1: found '-3'");
  check_error("1.5\n", "a.ptx:1: found '1.5'");
  check_error("1 2 3\n", "a.ptx:1: found 3 columns, expected the number of columns");
  check_error("1\n1\n0 0\n", "a.ptx:3: found 2 columns, expected the scanner's position");
  check_error(ptx("1", "2", "0 0 5 1\n"),
              "the file ends after 1 beams, expected 1 columns of 2 beams");
  check_error(ptx("1", "1", "0 0 5 1\n0 0 5 1\n"), "a.ptx:12: found more than the 1 beams");
  check_error(ptx("1", "1", "0 0 5 1\n") + ptx("1", "1", "0 0 5 1\n"),
              "a.ptx:12: found a second scan");
  check_error(ptx("1", "1", "0 zero 5 1\n"), "a.ptx:11: found 'zero' for y");
  check_error(ptx("1", "2", "0 0 5 1\n0 0 5 1 9 9 9\n"), "a.ptx:12: found 7 columns, expected 4");
  check_error(ptx("1", "1", "0,5 0 5 1\n"), "a.ptx:11: found '0,5' for x");
  check_error(ptx("100000000", "100000000", "0 0 5 1\n"), "too short");
}

TEST_CASE("A file that is none of the formats, or not there, is an error by name") {
  const TemporaryDirectory directory;
  CHECK_THROWS_WITH(read_cloud(directory / "a.las"), Contains("a.las: found '.las', expected"));
  CHECK_THROWS_WITH(read_cloud(directory / "a.xyz"), Contains("a.xyz: no such file"));
  CHECK_THROWS_WITH(read_cloud(directory.path()), Contains("expected"));
  std::ofstream(directory / "UPPER.XYZ") << "1 2 3\n";
  CHECK(read_cloud(directory / "UPPER.XYZ").beams.size() == 1);
}
