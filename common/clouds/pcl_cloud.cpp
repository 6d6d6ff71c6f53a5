// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/pcl_cloud.h"

#include <dlfcn.h>

#include <cstring>

#include "common/clouds/columns.h"
#include "common/clouds/pcl_table.h"
#include "common/clouds/text_lines.h"
#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::clouds {

namespace {

/// The module with PCL in it, opened once and kept.
struct PclModule {
  decltype(&berth_pcl_header) header;
  decltype(&berth_pcl_read) read;

  static const PclModule& get() {
    static const PclModule module = open();
    return module;
  }

 private:
  static PclModule open() {
    void* const library = dlopen("libberth_pcl.so", RTLD_NOW | RTLD_LOCAL);
    PclModule module{};
    if (library != nullptr) {
      module.header = reinterpret_cast<decltype(header)>(dlsym(library, "berth_pcl_header"));
      module.read = reinterpret_cast<decltype(read)>(dlsym(library, "berth_pcl_read"));
    }
    if (module.header == nullptr || module.read == nullptr) {
      throw InputError(std::string("PCD and PLY cannot be read: ") + dlerror());
    }
    return module;
  }
};

/// A field of the library's untyped cloud.
class Field {
 public:
  Field(const PclTable::Field& field, double scale)
      : offset_(field.offset), type_(field.type), scale_(scale) {}

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
      case PclTable::Type::int8:
        return as<std::int8_t>(bytes);
      case PclTable::Type::uint8:
        return as<std::uint8_t>(bytes);
      case PclTable::Type::int16:
        return as<std::int16_t>(bytes);
      case PclTable::Type::uint16:
        return as<std::uint16_t>(bytes);
      case PclTable::Type::int32:
        return as<std::int32_t>(bytes);
      case PclTable::Type::uint32:
        return as<std::uint32_t>(bytes);
      case PclTable::Type::int64:
        return as<std::int64_t>(bytes);
      case PclTable::Type::uint64:
        return as<std::uint64_t>(bytes);
      case PclTable::Type::float32:
        return as<float>(bytes);
      case PclTable::Type::float64:
        return as<double>(bytes);
    }
    return 0;
  }

  std::size_t offset_;
  PclTable::Type type_;
  double scale_;
};

Cloud cloud_of(const PclTable& table, const std::string& file) {
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

  const std::size_t count = table.width * table.height;
  if (count == 0) throw InputError(file + ": holds no point");
  if (table.row_bytes == 0 || table.bytes.size() / table.row_bytes < count) {
    throw InputError(file + ": found fewer points than the " + std::to_string(count) +
                     " that the header promises");
  }
  cloud.beams.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* point = table.bytes.data() + i * table.row_bytes;
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

Cloud read(const std::filesystem::path& path, PclFormat format) {
  const PclModule& module = PclModule::get();
  const std::string file = path.string();
  PclTable table;
  std::string why;
  const PclHeader header = module.header(file, format, why);
  if (header == PclHeader::text) check_words(file);
  if (header == PclHeader::unsound || !module.read(file, format, table, why)) {
    throw InputError(file + ": found a damaged file or one of another kind, expected " +
                     (format == PclFormat::pcd ? "PCD" : "PLY") +
                     (why.empty() ? "" : " (" + why + ")"));
  }
  Cloud cloud = cloud_of(table, file);
  if (table.has_viewpoint) {
    cloud.notes.push_back("the file's viewpoint is not used: points are taken as they stand");
  }
  return cloud;
}

}  // namespace

Cloud read_pcd(const std::filesystem::path& path) { return read(path, PclFormat::pcd); }

Cloud read_ply(const std::filesystem::path& path) { return read(path, PclFormat::ply); }

}  // namespace berth::clouds
