// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/model/model_file.h"

#include <cstring>
#include <fstream>

#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/sha256.h"

namespace berth::estimator {

namespace {

// Incremented whenever the compiled model or its computation changes.
constexpr std::uint32_t format_version = 8;
constexpr std::size_t checksum_length = 64;

/// FNV-1a over 8-byte words, against damage: a few ms for 10 MB.
std::string checksum(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037U;
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    hash = (hash ^ word) * 1099511628211U;
    hash ^= hash >> 29;
  }
  for (; i < bytes.size(); ++i) {
    hash = (hash ^ static_cast<unsigned char>(bytes[i])) * 1099511628211U;
  }
  return sha256({reinterpret_cast<const char*>(&hash), sizeof hash});
}

struct Writer {
  std::string bytes;

  template <class T>
  void value(const T& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  template <class T>
  void list(const std::vector<T>& v) {
    value<std::uint64_t>(v.size());
    bytes.append(reinterpret_cast<const char*>(v.data()), v.size() * sizeof(T));
  }
  void vector(const Vector3d& v) {
    for (Eigen::Index i = 0; i < 3; ++i) value(v[i]);
  }
  void rotation(const Quaterniond& rotation) {
    for (const double q : rotation.coeffs()) value(q);
  }
  void pose(const Pose& p) {
    vector(p.position);
    rotation(p.rotation);
  }
  void view(const ViewTemplate& v) {
    rotation(v.view);
    for (const float c : v.points.reshaped()) value(c);
    value<std::uint64_t>(static_cast<std::uint64_t>(v.outside.rows()));
    for (const float c : v.outside.reshaped()) value(c);
    value(v.area);
    value(v.perimeter);
  }
};

struct Reader {
  std::string_view bytes;
  bool good = true;

  bool take(void* to, std::size_t size) {
    if (!good || size > bytes.size()) return good = false;
    if (size > 0) std::memcpy(to, bytes.data(), size);
    bytes.remove_prefix(size);
    return true;
  }
  template <class T>
  void value(T& v) {
    take(&v, sizeof v);
  }
  template <class T>
  void list(std::vector<T>& v) {
    std::uint64_t size = 0;
    value(size);
    if (!good || size > bytes.size() / sizeof(T)) {
      good = false;
      return;
    }
    v.resize(size);
    take(static_cast<void*>(v.data()), size * sizeof(T));
  }
  void vector(Vector3d& v) {
    for (Eigen::Index i = 0; i < 3; ++i) value(v[i]);
  }
  void rotation(Quaterniond& rotation) {
    for (double& q : rotation.coeffs()) value(q);
  }
  void pose(Pose& p) {
    vector(p.position);
    rotation(p.rotation);
  }
  void view(ViewTemplate& v) {
    rotation(v.view);
    for (float& c : v.points.reshaped()) value(c);
    std::uint64_t outside = 0;
    value(outside);
    good = good && outside <= ViewTemplate::outside_points;
    if (!good) return;
    v.outside.resize(static_cast<Eigen::Index>(outside), 3);
    for (float& c : v.outside.reshaped()) value(c);
    value(v.area);
    value(v.perimeter);
  }
};

}  // namespace

std::string ModelFile::name(const Target& target, const ModelOptions& options) {
  Writer key;
  key.value(format_version);
  key.bytes += target.hash;
  key.value(options.surface_samples);
  key.value(options.template_rotations);
  key.value(options.template_voxels);
  key.value(options.grid_voxels);
  key.value(options.grid_margin);
  key.value(options.region_radius);
  key.value(options.views);
  return sha256(key.bytes) + ".model";
}

bool ModelFile::write(const std::filesystem::path& path, const TargetModel& model) {
  Writer out;
  out.list(model.surface.samples);
  out.list(model.surface.triangles);
  out.pose(model.canonical.pose);
  out.vector(model.canonical.spread);
  out.value(model.canonical.half_length);
  out.value(model.canonical.radius);
  out.value(model.templates.cell_);
  out.value(model.templates.height_);
  out.value<std::uint64_t>(model.templates.templates_.size());
  for (const VoxelRows& rows : model.templates.templates_) out.list(rows.rows);
  out.vector(model.grid.low_);
  out.value(model.grid.cell_);
  out.value(model.grid.size_);
  out.list(model.grid.nearest_);
  out.list(model.grid.points_);
  out.list(model.grid.triangles_);
  out.list(model.regions);
  out.value<std::uint64_t>(model.views.size());
  for (const ViewTemplate& v : model.views) out.view(v);
  out.value<std::uint64_t>(model.symmetries.motions.size());
  for (const Symmetry& s : model.symmetries.motions) {
    out.pose(s.motion);
    out.value(s.deviation_m);
    out.value(s.exact);
  }
  out.value(model.symmetries.revolution);
  out.vector(model.symmetries.axis);
  out.vector(model.symmetries.centre);

  std::error_code error;
  std::filesystem::create_directories(path.parent_path(), error);
  try {
    WholeFile file(path);
    file.write(checksum(out.bytes));
    file.write({out.bytes.data(), out.bytes.size()});
    file.finish();
  } catch (const InputError&) {
    return false;
  }
  return true;
}

bool ModelFile::read(const std::filesystem::path& path, TargetModel& model) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) return false;
  const auto size = static_cast<std::size_t>(file.tellg());
  if (size < checksum_length) return false;
  std::string content(size, '\0');
  file.seekg(0);
  file.read(content.data(), static_cast<std::streamsize>(size));
  if (!file) return false;
  const std::string_view body = std::string_view(content).substr(checksum_length);
  if (checksum(body) != content.substr(0, checksum_length)) return false;

  Reader in{body};
  in.list(model.surface.samples);
  in.list(model.surface.triangles);
  in.pose(model.canonical.pose);
  in.vector(model.canonical.spread);
  in.value(model.canonical.half_length);
  in.value(model.canonical.radius);
  in.value(model.templates.cell_);
  in.value(model.templates.height_);
  std::uint64_t templates = 0;
  in.value(templates);
  if (templates > static_cast<std::uint64_t>(model.options.template_rotations)) return false;
  for (std::uint64_t i = 0; i < templates && in.good; ++i) {
    VoxelRows& rows = model.templates.templates_.emplace_back(model.templates.height_);
    in.list(rows.rows);
  }
  in.vector(model.grid.low_);
  in.value(model.grid.cell_);
  in.value(model.grid.size_);
  in.list(model.grid.nearest_);
  in.list(model.grid.points_);
  in.list(model.grid.triangles_);
  in.list(model.regions);
  std::uint64_t views = 0;
  in.value(views);
  if (views > static_cast<std::uint64_t>(model.options.views)) return false;
  for (std::uint64_t i = 0; i < views && in.good; ++i) in.view(model.views.emplace_back());
  std::uint64_t motions = 0;
  in.value(motions);
  for (std::uint64_t i = 0; i < motions && in.good; ++i) {
    Symmetry& s = model.symmetries.motions.emplace_back();
    in.pose(s.motion);
    in.value(s.deviation_m);
    in.value(s.exact);
  }
  in.value(model.symmetries.revolution);
  in.vector(model.symmetries.axis);
  in.vector(model.symmetries.centre);
  return in.good && in.bytes.empty();
}

}  // namespace berth::estimator
