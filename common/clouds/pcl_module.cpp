// SPDX-License-Identifier: BSD-3-Clause
// The only source that sees PCL. It is a module of its own, opened when the first PCD or PLY is
// read: PCL brings sixty libraries, which take longer to load than all others together.
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

#include "common/clouds/pcl_table.h"

namespace berth::clouds {
namespace {

/// The library believes what a header promises and crashes on some that it cannot keep.
/// bytes: of the points. Its compression does not reach a hundredth.
bool can_hold(const std::string& file, std::uint64_t bytes) {
  return bytes > 0 && bytes / 100 <= std::filesystem::file_size(file);
}

PclHeader header_of(pcl::PCDReader& reader, const std::string& file) {
  pcl::PCLPointCloud2 table;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  int type = 0;
  unsigned start = 0;
  if (reader.readHeader(file, table, origin, orientation, version, type, start) < 0) {
    return PclHeader::unsound;
  }
  std::uint64_t bytes = std::uint64_t{table.width} * table.height * table.point_step;
  if (!can_hold(file, bytes)) return PclHeader::unsound;
  constexpr int ascii = 0;
  constexpr int compressed = 2;
  if (type == ascii) return PclHeader::text;
  if (type == compressed) {  // two sizes come first: compressed and not
    std::uint32_t size = 0;
    std::ifstream in(file, std::ios::binary);
    in.seekg(start);
    if (!in.read(reinterpret_cast<char*>(&size), sizeof size)) return PclHeader::unsound;
    bytes = 2 * sizeof size + std::uint64_t{size};
  }
  const bool whole = start + bytes <= std::filesystem::file_size(file);
  return whole ? PclHeader::sound : PclHeader::unsound;
}

PclHeader header_of(pcl::PLYReader&, const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::string line;
  std::uint64_t points = 0;
  if (!std::getline(in, line) || line.compare(0, 3, "ply") != 0) return PclHeader::unsound;
  while (std::getline(in, line)) {
    if (line.compare(0, 10, "end_header") == 0) {
      return points == 0 || can_hold(file, points) ? PclHeader::sound : PclHeader::unsound;
    }
    unsigned long long count = 0;
    if (std::sscanf(line.c_str(), "element vertex %llu", &count) == 1) points += count;
  }
  return PclHeader::unsound;
}

PclTable::Type type_of(const pcl::PCLPointField& field) {
  switch (field.datatype) {
    case pcl::PCLPointField::INT8:
      return PclTable::Type::int8;
    case pcl::PCLPointField::UINT8:
      return PclTable::Type::uint8;
    case pcl::PCLPointField::INT16:
      return PclTable::Type::int16;
    case pcl::PCLPointField::UINT16:
      return PclTable::Type::uint16;
    case pcl::PCLPointField::INT32:
      return PclTable::Type::int32;
    case pcl::PCLPointField::UINT32:
      return PclTable::Type::uint32;
    case pcl::PCLPointField::INT64:
      return PclTable::Type::int64;
    case pcl::PCLPointField::UINT64:
      return PclTable::Type::uint64;
    case pcl::PCLPointField::FLOAT32:
      return PclTable::Type::float32;
    default:
      return PclTable::Type::float64;
  }
}

template <class Reader>
bool read(const std::string& file, PclTable& table) {
  pcl::PCLPointCloud2 cloud;
  Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
  int version = 0;
  if (Reader().read(file, cloud, origin, orientation, version) < 0) return false;
  for (const pcl::PCLPointField& field : cloud.fields) {
    table.fields.push_back({field.name, field.offset, type_of(field)});
  }
  table.width = cloud.width;
  table.height = cloud.height;
  table.row_bytes = cloud.point_step;
  table.bytes = std::move(cloud.data);
  table.has_viewpoint =
      !origin.head<3>().isZero() || !orientation.isApprox(Eigen::Quaternionf::Identity());
  return true;
}

/// What work() makes; otherwise, with what it threw in why.
template <class Result, class Work>
Result guarded(std::string& why, Result otherwise, Work work) {
  // The library talks to the console; what went wrong is for us to say.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  try {
    return work();
  } catch (const std::exception& e) {
    why = e.what();
    return otherwise;
  }
}

}  // namespace

PclHeader berth_pcl_header(const std::string& file, PclFormat format, std::string& why) {
  return guarded(why, PclHeader::unsound, [&] {
    if (format == PclFormat::ply) {
      pcl::PLYReader reader;
      return header_of(reader, file);
    }
    pcl::PCDReader reader;
    return header_of(reader, file);
  });
}

bool berth_pcl_read(const std::string& file, PclFormat format, PclTable& table, std::string& why) {
  return guarded(why, false, [&] {
    return format == PclFormat::ply ? read<pcl::PLYReader>(file, table)
                                    : read<pcl::PCDReader>(file, table);
  });
}

}  // namespace berth::clouds
