// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/pcl_cloud.h"

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <cstdio>
#include <cstring>
#include <fstream>

#include "common/clouds/columns.h"
#include "common/clouds/text_lines.h"
#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::clouds {

namespace {

/// A field of the library's untyped cloud.
class Field {
 public:
  Field(const pcl::PCLPointField& field, double scale)
      : offset_(field.offset), type_(field.datatype), scale_(scale) {}

  double of(const std::uint8_t* point) const { return scale_ * value(point + offset_); }

 private:
  template <class T>
  static double as(const std::uint8_t* bytes) {
    T number;
    std::memcpy(&number, bytes, sizeof number);
    return static_cast<double>(number);
  }

  double value(const std::uint8_t* bytes) const {
    switch (type_) {
      case pcl::PCLPointField::INT8:
        return as<std::int8_t>(bytes);
      case pcl::PCLPointField::UINT8:
        return as<std::uint8_t>(bytes);
      case pcl::PCLPointField::INT16:
        return as<std::int16_t>(bytes);
      case pcl::PCLPointField::UINT16:
        return as<std::uint16_t>(bytes);
      case pcl::PCLPointField::INT32:
        return as<std::int32_t>(bytes);
      case pcl::PCLPointField::UINT32:
        return as<std::uint32_t>(bytes);
      case pcl::PCLPointField::INT64:
        return as<std::int64_t>(bytes);
      case pcl::PCLPointField::UINT64:
        return as<std::uint64_t>(bytes);
      case pcl::PCLPointField::FLOAT32:
        return as<float>(bytes);
      default:
        return as<double>(bytes);
    }
  }

  std::size_t offset_;
  std::uint8_t type_;
  double scale_;
};

Cloud cloud_of(const pcl::PCLPointCloud2& table, const std::string& file) {
  std::vector<std::string> names;
  for (const auto& field : table.fields) names.push_back(field.name);
  const Columns columns = find_columns(names);
  if (!columns.has_point()) {
    std::string found;
    for (const std::string& name : names) found += (found.empty() ? "" : " ") + name;
    throw InputError(file + ": found the fields '" + found + "', expected x, y and z among them");
  }
  const auto field = [&](int column, double scale = 1) {
    return Field(table.fields[static_cast<std::size_t>(column)], scale);
  };
  const Field x = field(columns.x);
  const Field y = field(columns.y);
  const Field z = field(columns.z);
  Cloud cloud;
  cloud.has_times = columns.time >= 0;
  cloud.has_sigmas = columns.sigma >= 0;
  const Field time = cloud.has_times ? field(columns.time, columns.us_per_time) : x;
  const Field sigma = cloud.has_sigmas ? field(columns.sigma) : x;

  const std::size_t count = std::size_t{table.width} * table.height;
  if (count == 0) throw InputError(file + ": holds no point");
  if (table.point_step == 0 || table.data.size() / table.point_step < count) {
    throw InputError(file + ": found fewer points than the " + std::to_string(count) +
                     " that the header promises");
  }
  cloud.beams.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* point = table.data.data() + i * table.point_step;
    CloudRow row;
    row.point = {x.of(point), y.of(point), z.of(point)};
    if (cloud.has_times) row.utime = time.of(point);
    if (cloud.has_sigmas) row.sigma = sigma.of(point);
    add_row(cloud, row);
  }
  if (table.height > 1) {  // an organised cloud: its empty places were beams
    cloud.counts.undirected = cloud.counts.not_finite;
    cloud.counts.not_finite = 0;
  }
  return cloud;
}

InputError damaged(const std::string& file, const char* format, const std::string& why = "") {
  return InputError(file + ": found a damaged file or one of another kind, expected " + format +
                    (why.empty() ? "" : " (" + why + ")"));
}

/// The library believes what a header promises and crashes on some that it cannot keep.
/// bytes: of the points. Its compression does not reach a hundredth.
bool can_hold(const std::string& file, std::uint64_t bytes) {
  return bytes > 0 && bytes / 100 <= std::filesystem::file_size(file);
}

/// Of a PCD of text: the library takes a word that is no number for 0.
void check_words(const std::string& file) {
  const std::string text = read_file(file);
  TextLines lines(text, file);
  bool in_header = true;
  while (lines.next()) {
    const std::size_t count = lines.words().size();
    for (std::size_t i = 0; i < count && !in_header; ++i) lines.number(i, "a coordinate or field");
    if (count > 0 && lines.words().front() == "DATA") in_header = false;
  }
}

bool header_is_sound(pcl::PCDReader& reader, const std::string& file) {
  pcl::PCLPointCloud2 table;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  int type = 0;
  unsigned start = 0;
  if (reader.readHeader(file, table, origin, orientation, version, type, start) < 0) return false;
  std::uint64_t bytes = std::uint64_t{table.width} * table.height * table.point_step;
  if (!can_hold(file, bytes)) return false;
  constexpr int ascii = 0;
  constexpr int compressed = 2;
  if (type == ascii) {
    check_words(file);
    return true;
  }
  if (type == compressed) {  // two sizes come first: compressed and not
    std::uint32_t size = 0;
    std::ifstream in(file, std::ios::binary);
    in.seekg(start);
    if (!in.read(reinterpret_cast<char*>(&size), sizeof size)) return false;
    bytes = 2 * sizeof size + std::uint64_t{size};
  }
  return start + bytes <= std::filesystem::file_size(file);
}

bool header_is_sound(pcl::PLYReader&, const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  std::uint64_t points = 0;
  if (!std::getline(in, line) || line.compare(0, 3, "ply") != 0) return false;
  while (std::getline(in, line)) {
    if (line.compare(0, 10, "end_header") == 0) return points == 0 || can_hold(file, points);
    unsigned long long count = 0;
    if (std::sscanf(line.c_str(), "element vertex %llu", &count) == 1) points += count;
  }
  return false;
}

template <class Reader>
Cloud read(const std::filesystem::path& path, const char* format) {
  // The library talks to the console; what went wrong is for us to say.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  const std::string file = path.string();
  pcl::PCLPointCloud2 table;
  Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
  int version = 0;
  try {
    Reader reader;
    if (!header_is_sound(reader, file) ||
        reader.read(file, table, origin, orientation, version) < 0) {
      throw damaged(file, format);
    }
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& e) {
    throw damaged(file, format, e.what());
  }
  Cloud cloud = cloud_of(table, file);
  if (!origin.head<3>().isZero() || !orientation.isApprox(Eigen::Quaternionf::Identity())) {
    cloud.notes.push_back("the file's viewpoint is not used: points are taken as they stand");
  }
  return cloud;
}

}  // namespace

Cloud read_pcd(const std::filesystem::path& path) { return read<pcl::PCDReader>(path, "PCD"); }

Cloud read_ply(const std::filesystem::path& path) { return read<pcl::PLYReader>(path, "PLY"); }

}  // namespace berth::clouds
