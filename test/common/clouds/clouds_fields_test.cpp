// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <limits>

#include "common/clouds/cloud.h"
#include "common/core/beam_model.h"
#include "common/core/error.h"
#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::clouds;
using Catch::Contains;

namespace {

Vector3d at(const CloudBeam& beam) {
  return beam.range * beam_direction(beam.azimuth, beam.elevation);
}

Cloud pcd(const std::string& bytes) { return parse_cloud(bytes, ".pcd", "d/a.pcd"); }
Cloud ply(const std::string& bytes) { return parse_cloud(bytes, ".ply", "d/a.ply"); }

template <class T>
std::string raw(T value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return bytes;
}

/// Points with an array, intensity, time and sigma; in an organised cloud every tenth
/// is empty.
struct Sample {
  std::size_t width = 100;
  std::size_t height = 1;
  std::vector<Vector3d> points;

  explicit Sample(bool organised) {
    if (organised) width = 25, height = 4;
    Random random(3, "cloud");
    for (int i = 0; i < 100; ++i) {
      Vector3d p = random.normal_vector(2).cast<float>().cast<double>();
      if (organised && i % 10 == 0) p.setConstant(std::numeric_limits<double>::quiet_NaN());
      points.push_back(p);
    }
  }

  std::string header(const std::string& data) const {
    return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n"
           "FIELDS x y z normal intensity time sigma\nSIZE 4 4 4 4 1 8 4\nTYPE F F F F U F F\n"
           "COUNT 1 1 1 3 1 1 1\nWIDTH " +
           std::to_string(width) + "\nHEIGHT " + std::to_string(height) +
           "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " + std::to_string(points.size()) + "\nDATA " + data +
           "\n";
  }

  static double time(std::size_t i) { return 1000 + 0.25 * static_cast<double>(i); }

  std::string row(std::size_t i) const {
    std::string bytes;
    for (const double coordinate : points[i]) bytes += raw(static_cast<float>(coordinate));
    return bytes + raw(0.F) + raw(0.F) + raw(1.F) + raw(std::uint8_t{7}) + raw(time(i)) +
           raw(0.0078125F);
  }

  std::string text() const {
    std::string text = header("ascii");
    char line[200];
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector3d& p = points[i];
      std::snprintf(line, sizeof line, "%.9g %.9g %.9g 0 0 1 7 %.9g 0.0078125\n", p.x(), p.y(),
                    p.z(), time(i));
      text += line;
    }
    return text;
  }

  std::string binary() const {
    std::string bytes = header("binary");
    for (std::size_t i = 0; i < points.size(); ++i) bytes += row(i);
    return bytes;
  }

  /// Field by field; LZF of nothing but literals.
  std::string compressed() const {
    std::string fields;
    std::size_t offset = 0;
    for (const std::size_t size : {4, 4, 4, 12, 1, 8, 4}) {
      for (std::size_t i = 0; i < points.size(); ++i) fields += row(i).substr(offset, size);
      offset += size;
    }
    std::string packed;
    for (std::size_t i = 0; i < fields.size(); i += 32) {
      const std::string run = fields.substr(i, 32);
      packed += static_cast<char>(run.size() - 1) + run;
    }
    return header("binary_compressed") + raw(static_cast<std::uint32_t>(packed.size())) +
           raw(static_cast<std::uint32_t>(fields.size())) + packed;
  }

  std::vector<std::string> files() const { return {text(), binary(), compressed()}; }
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto found = text.find(what);
  REQUIRE(found != std::string::npos);
  return text.replace(found, what.size(), by);
}

const std::string ply_head =
    "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
    "property float z\n";

}  // namespace

TEST_CASE("PCD: text, binary and compressed come back, with times and sigmas") {
  const Sample sample(false);
  for (const std::string& file : sample.files()) {
    CAPTURE(file.substr(0, 400));
    const Cloud cloud = pcd(file);
    CHECK(cloud.has_times);
    CHECK(cloud.has_sigmas);
    CHECK_FALSE(cloud.has_misses);
    CHECK(cloud.counts.points == 100);
    REQUIRE(cloud.beams.size() == 100);
    for (std::size_t i = 0; i < 100; ++i) {
      REQUIRE((at(cloud.beams[i]) - sample.points[i]).norm() < 1e-6);
      REQUIRE(cloud.beams[i].range_sigma == 0.0078125);
    }
    CHECK(cloud.beams.back().utime == 1024750000);
  }
}

TEST_CASE("PCD: what PCL compressed comes back") {
  // 24 points (0 or 0.5, 1, 2 or 3) and their numbers; written by PCL 1.13, filled to a page
  const unsigned char data[] = {
      0x54, 0,    0,    0,    0x50, 1,   0,    0,    1,    0,    0,    0x60, 0,    0,   0x3f, 0x60,
      5,    0,    0,    0xe0, 0x4b, 7,   0,    0x80, 0x20, 0x5b, 0xe0, 0x53, 3,    1,   0,    0x40,
      0x20, 0xb7, 0xe0, 0x22, 3,    0,   0x40, 0x20, 0x2b, 0xe0, 0x23, 3,    0x1f, 1,   0,    2,
      0,    3,    0,    4,    0,    5,   0,    6,    0,    7,    0,    8,    0,    9,   0,    0xa,
      0,    0xb,  0,    0xc,  0,    0xd, 0,    0xe,  0,    0xf,  0,    0x10, 0,    0xd, 0x11, 0,
      0x12, 0,    0x13, 0,    0x14, 0,   0x15, 0,    0x16, 0,    0x17, 0};
  const std::string file =
      "VERSION 0.7\nFIELDS x y z ring\nSIZE 4 4 4 2\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 24\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 24\nDATA binary_compressed\n" +
      std::string(reinterpret_cast<const char*>(data), sizeof data) + std::string(500, '\0');
  const Cloud cloud = pcd(file);
  REQUIRE(cloud.beams.size() == 24);
  for (int i = 0; i < 24; ++i) {
    CHECK((at(cloud.beams[static_cast<std::size_t>(i)]) - Vector3d(0.5 * (i % 2), 1, 2 + i / 12))
              .norm() < 1e-12);
  }
}

TEST_CASE("PCD: points that are no numbers in an organised cloud are empty beams") {
  const Sample sample(true);
  for (const std::string& file : sample.files()) {
    const Cloud cloud = pcd(file);
    CHECK(cloud.counts.undirected == 10);
    CHECK(cloud.counts.hits == 90);
  }
}

TEST_CASE("PCD: a file cut short, or longer than its header says, is refused by name") {
  const Sample sample(false);
  for (const std::string& file : sample.files()) {
    for (const double share : {0.0, 0.01, 0.05, 0.1, 0.3, 0.6, 0.99}) {
      CAPTURE(share);
      const auto size = static_cast<std::size_t>(share * static_cast<double>(file.size()));
      CHECK_THROWS_WITH(pcd(file.substr(0, size)), Contains("d/a.pcd"));
    }
    CHECK_THROWS_WITH(pcd(replaced(file, "POINTS 100", "POINTS 99")), Contains("found 99 POINTS"));
    const std::string more = replaced(file, "POINTS 100", "POINTS 101");
    CHECK_THROWS_WITH(pcd(replaced(more, "WIDTH 100", "WIDTH 101")), Contains("d/a.pcd"));
    const std::string fewer = replaced(file, "POINTS 100", "POINTS 99");
    CHECK_THROWS_WITH(pcd(replaced(fewer, "WIDTH 100", "WIDTH 99")), Contains("d/a.pcd"));
  }
  std::string damaged = sample.compressed();
  damaged[sample.header("binary_compressed").size() + 8 + 330] = '\xFF';
  CHECK_THROWS_WITH(pcd(damaged), Contains("damaged data"));
}

TEST_CASE("PCD: a row of text too wide, or a word, is refused by line; what is no number is none") {
  const std::string file =
      "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\n4 5 6\n";
  CHECK(pcd(file).beams.size() == 2);
  CHECK_THROWS_WITH(pcd(replaced(file, "4 5 6", "4 5 6 7")),
                    Contains("a.pcd:12: found 4 columns, expected 3"));
  CHECK_THROWS_WITH(pcd(replaced(file, "1 2 3", "1 2 3 7")),
                    Contains("a.pcd:11: found 4 columns, expected 3"));
  CHECK_THROWS_WITH(pcd(replaced(file, "4 5 6", "4 five 6")), Contains("a.pcd:12: found 'five'"));
  CHECK(pcd(replaced(file, "4 5 6", "-1.#IND 1.#QNAN nan(ind)")).counts.not_finite == 1);
  CHECK(at(pcd(replaced(file, "1 2 3", "1,0 2,5 3,0")).beams[0]).y() == Approx(2.5));
  CHECK_THROWS_WITH(pcd(replaced(file, "FIELDS x y z", "FIELDS u v w")),
                    Contains("found the fields 'u v w', expected x, y and z"));
  CHECK_THROWS_WITH(pcd(replaced(file, "FIELDS x y z", "FIELDS x y")),
                    Contains("a.pcd:3: found 3 values of SIZE, expected one for each of the 2"));
  CHECK_THROWS_WITH(pcd(replaced(file, "COUNT 1 1 1", "COUNT 1 0 1")), Contains("found '0'"));
  CHECK_THROWS_WITH(pcd(replaced(file, "ascii", "zip")), Contains("found DATA 'zip'"));
  CHECK_THROWS_WITH(pcd(replaced(file, "TYPE F F F", "TYPE F F B")), Contains("found TYPE 'B'"));
  const Cloud turned = pcd(replaced(file, "VIEWPOINT 0", "VIEWPOINT 1"));
  REQUIRE(turned.notes.size() == 1);
  CHECK_THAT(turned.notes[0], Contains("viewpoint"));
}

TEST_CASE("PLY: other elements, lists and further properties do not matter") {
  CHECK(ply(ply_head + "property list uchar int view\nend_header\n0 0 5 1 0\n1 0 5 2 0 1\n")
            .beams.size() == 2);
  const Cloud cloud =
      ply("ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
          "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
          "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
          "1.00000000001 2 3 1 2 3\n4 5 6 1 2 3\nnan 8 9 1 2 3\n3 0 1 2\n");
  REQUIRE(cloud.beams.size() == 2);
  CHECK(cloud.counts.not_finite == 1);
  CHECK(std::abs(at(cloud.beams[0]).x() - 1.00000000001) < 1e-14);
  std::string binary = replaced(ply_head, "ascii", "binary_big_endian") + "end_header\n";
  for (const float coordinate : {0.F, 0.F, 5.F, 1.F, 2.F, 3.F}) {
    std::string bytes = raw(coordinate);
    std::reverse(bytes.begin(), bytes.end());
    binary += bytes;
  }
  CHECK((at(ply(binary).beams.at(1)) - Vector3d(1, 2, 3)).norm() < 1e-12);
}

TEST_CASE("PLY: what is no cloud is refused by name") {
  const auto check_error = [](const std::string& bytes, const char* part) {
    CAPTURE(bytes);
    CHECK_THROWS_WITH(ply(bytes), Contains("d/a.ply") && Contains(part));
  };
  check_error("", "expected");
  check_error(std::string(5000, '\xfe'), "expected");
  check_error("ply\nformat ascii 1.0\nelement vertex 1\nproperty float u\nend_header\n1\n",
              "found the fields 'u', expected x, y and z");
  check_error("ply\nformat ascii 1.0\nelement face 0\nend_header\n", "no element 'vertex'");
  check_error(replaced(ply_head, "vertex 2", "vertex 0") + "end_header\n", "holds no point");
  check_error(replaced(ply_head, "vertex 2", "vertex 4000000000") + "end_header\n1 2 3\n",
              "cut short");
  check_error(ply_head + "end_header\n-0,28 -0,47 7,75\n0,1 0,2 3,4\n", "a.ply:8: ");
  check_error(ply_head + "end_header\n1 2 3\n1 two 3\n", "a.ply:9: ");
  for (const std::string& bytes : {std::string(), std::string("nonsense\n")}) {
    CHECK_THROWS_WITH(pcd(bytes), Contains("d/a.pcd") && Contains("expected"));
  }
}
