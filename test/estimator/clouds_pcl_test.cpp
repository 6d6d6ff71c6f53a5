// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <cstring>
#include <fstream>
#include <sstream>

#include "common/clouds/cloud.h"
#include "common/core/beam_model.h"
#include "common/core/error.h"
#include "common/core/random.h"
#include "test/catch.h"
#include "test/core/temporary_directory.h"

using namespace berth;
using namespace berth::clouds;
using Catch::Contains;

namespace {

struct Written {
  pcl::PCLPointCloud2 table;
  std::vector<Vector3d> points;
};

void add_field(pcl::PCLPointCloud2& table, const char* name, std::uint8_t type, unsigned size) {
  pcl::PCLPointField field;
  field.name = name;
  field.offset = table.point_step;
  field.datatype = type;
  field.count = 1;
  table.fields.push_back(field);
  table.point_step += size;
}

template <class T>
void put(std::vector<std::uint8_t>& bytes, T value) {
  const auto* begin = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

/// 1,000 points with intensity, time and sigma; NaN at every 100th when organised.
Written written(bool organised) {
  Written w;
  add_field(w.table, "x", pcl::PCLPointField::FLOAT32, 4);
  add_field(w.table, "y", pcl::PCLPointField::FLOAT32, 4);
  add_field(w.table, "z", pcl::PCLPointField::FLOAT32, 4);
  add_field(w.table, "intensity", pcl::PCLPointField::FLOAT32, 4);
  add_field(w.table, "time", pcl::PCLPointField::FLOAT64, 8);
  add_field(w.table, "sigma", pcl::PCLPointField::FLOAT32, 4);
  w.table.width = organised ? 50 : 1000;
  w.table.height = organised ? 20 : 1;
  w.table.is_dense = !organised;
  Random random(3, "cloud");
  for (int i = 0; i < 1000; ++i) {
    Eigen::Vector3f p = random.normal_vector(2).cast<float>();
    if (organised && i % 100 == 0) p.setConstant(std::numeric_limits<float>::quiet_NaN());
    for (const float coordinate : p) put(w.table.data, coordinate);
    put(w.table.data, 0.5F);
    put(w.table.data, 1000.0 + 0.25 * i);
    put(w.table.data, 0.0078125F);
    if (p.allFinite()) w.points.push_back(p.cast<double>());
  }
  w.table.row_step = w.table.point_step * w.table.width;
  return w;
}

using Write = std::function<void(const std::string& file, const pcl::PCLPointCloud2&)>;

const Eigen::Vector4f origin = Eigen::Vector4f::Zero();
const Eigen::Quaternionf facing = Eigen::Quaternionf::Identity();

const std::vector<std::pair<std::string, Write>>& writers() {
  static const std::vector<std::pair<std::string, Write>> all = {
      {"ascii.pcd",
       [](const auto& file, const auto& table) {
         pcl::PCDWriter().writeASCII(file, table, origin, facing, 9);
       }},
      {"binary.pcd",
       [](const auto& file, const auto& table) {
         pcl::PCDWriter().writeBinary(file, table, origin, facing);
       }},
      {"compressed.pcd",
       [](const auto& file, const auto& table) {
         pcl::PCDWriter().writeBinaryCompressed(file, table, origin, facing);
       }},
      {"ascii.ply",
       [](const auto& file, const auto& table) {
         pcl::PLYWriter().writeASCII(file, table, origin, facing, 9);
       }},
      {"binary.ply",
       [](const auto& file, const auto& table) {
         pcl::PLYWriter().writeBinary(file, table, origin, facing);
       }},
  };
  return all;
}

void check_beams(const Cloud& cloud, const Written& w) {
  REQUIRE(cloud.beams.size() == w.points.size());
  for (std::size_t i = 0; i < cloud.beams.size(); ++i) {
    const CloudBeam& beam = cloud.beams[i];
    const Vector3d point = beam.range * beam_direction(beam.azimuth, beam.elevation);
    REQUIRE((point - w.points[i]).norm() < 1e-6);
    REQUIRE(beam.range_sigma == 0.0078125);
    REQUIRE(beam.hit);
  }
  CHECK(cloud.beams.back().utime == 1249750000);
}

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace

TEST_CASE("Clouds that PCL wrote come back, with times and sigmas") {
  const TemporaryDirectory directory;
  const Written w = written(false);
  for (const auto& [name, write] : writers()) {
    CAPTURE(name);
    write((directory / name).string(), w.table);
    const Cloud cloud = read_cloud(directory / name);
    CHECK(cloud.has_times);
    CHECK(cloud.has_sigmas);
    CHECK_FALSE(cloud.has_misses);
    CHECK(cloud.counts.points == 1000);
    CHECK(cloud.notes.empty());
    check_beams(cloud, w);
  }
}

TEST_CASE("Points that are no numbers in an organised cloud are empty beams: dropped and counted") {
  const TemporaryDirectory directory;
  const Written w = written(true);
  for (const auto& [name, write] : writers()) {
    if (name.find(".pcd") == std::string::npos) continue;
    CAPTURE(name);
    write((directory / name).string(), w.table);
    const Cloud cloud = read_cloud(directory / name);
    CHECK(cloud.counts.undirected == 10);
    CHECK(cloud.counts.hits == 990);
    check_beams(cloud, w);
  }
}

TEST_CASE("A file cut short is an error by name, or what is there of it, never a crash") {
  const TemporaryDirectory directory;
  const Written w = written(false);
  for (const auto& [name, write] : writers()) {
    write((directory / name).string(), w.table);
    const std::string whole = content(directory / name);
    for (const double share : {0.0, 0.004, 0.02, 0.3, 0.6}) {
      CAPTURE(name, share);
      const auto size = static_cast<std::size_t>(share * static_cast<double>(whole.size()));
      std::ofstream(directory / ("cut-" + name), std::ios::binary) << whole.substr(0, size);
      CHECK_THROWS_WITH(read_cloud(directory / ("cut-" + name)), Contains("cut-" + name));
    }
  }
}

TEST_CASE("What is no cloud is an error by name") {
  const TemporaryDirectory directory;
  const auto says = [&](const char* name, const std::string& text, const char* part) {
    CAPTURE(name, text);
    std::ofstream(directory / name, std::ios::binary) << text;
    CHECK_THROWS_WITH(read_cloud(directory / name), Contains(name) && Contains(part));
  };
  const std::string pcd =
      "VERSION .7\nFIELDS %\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n1 2 3\n";
  const auto with_fields = [&](const char* fields) {
    return std::string(pcd).replace(pcd.find('%'), 1, fields);
  };
  for (const char* name : {"a.pcd", "a.ply"}) {
    says(name, "", "expected");
    says(name, "nonsense\n", "expected");
    says(name, std::string(5000, '\xfe'), "expected");
  }
  says("a.pcd", with_fields("u v w"), "found the fields 'u v w', expected x, y and z");
  says("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float u\nend_header\n1\n",
       "found the fields 'u', expected x, y and z");
  says("a.ply",
       "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\n"
       "property float z\nend_header\n",
       "holds no point");
  says("a.ply",
       "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
       "property float z\nend_header\n1 2 3\n",
       "expected");
}

TEST_CASE("A PLY in double precision keeps it, and a mesh's faces do not matter") {
  const TemporaryDirectory directory;
  std::ofstream(directory / "a.ply")
      << "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
         "property double z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "1.00000000001 2 3 1 2 3\n4 5 6 1 2 3\n7 8 9 1 2 3\n3 0 1 2\n";
  const Cloud cloud = read_cloud(directory / "a.ply");
  REQUIRE(cloud.beams.size() == 3);
  const CloudBeam& beam = cloud.beams[0];
  const Vector3d point = beam.range * beam_direction(beam.azimuth, beam.elevation);
  CHECK(std::abs(point.x() - 1.00000000001) < 1e-14);
}

TEST_CASE("A word among the coordinates is never a point") {
  const TemporaryDirectory directory;
  std::ofstream(directory / "a.ply")
      << "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
         "property float z\nend_header\n1 2 3\n1 two 3\n";
  const Cloud cloud = read_cloud(directory / "a.ply");
  CHECK(cloud.counts.hits == 1);
  CHECK(cloud.counts.not_finite == 1);
  std::ofstream(directory / "a.pcd")
      << "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
         "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n1 2 3\n1 two 3\n";
  CHECK_THROWS_WITH(read_cloud(directory / "a.pcd"), Contains("a.pcd:12: found 'two'"));
}

TEST_CASE("A viewpoint other than the origin is noted") {
  const TemporaryDirectory directory;
  const Written w = written(false);
  pcl::PCDWriter().writeBinary((directory / "a.pcd").string(), w.table, {1, 2, 3, 0}, facing);
  const Cloud cloud = read_cloud(directory / "a.pcd");
  REQUIRE(cloud.notes.size() == 1);
  CHECK_THAT(cloud.notes[0], Contains("viewpoint"));
  check_beams(cloud, w);
}
