// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/clouds/pcl_cloud.h"

#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <cstring>

#include "common/core/error.h"
#include "estimator/clouds/columns.h"

namespace berth::estimator {

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

template <class Reader>
Cloud read(const std::filesystem::path& path, const char* format) {
  // The library talks to the console; what went wrong is for us to say.
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);
  const std::string file = path.string();
  pcl::PCLPointCloud2 table;
  Eigen::Vector4f origin = Eigen::Vector4f::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
  int version = 0;
  bool fine = false;
  std::string why;
  try {
    Reader reader;
    fine = reader.read(file, table, origin, orientation, version) >= 0;
  } catch (const std::exception& e) {
    why = std::string(" (") + e.what() + ")";
  }
  if (!fine) {
    throw InputError(file + ": found a damaged file or one of another kind, expected " + format +
                     why);
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

}  // namespace berth::estimator
