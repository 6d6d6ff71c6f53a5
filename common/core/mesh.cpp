// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <unordered_map>

#include "common/core/error.h"
#include "common/core/sha256.h"

namespace berth {

Vector3d nearest_on_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b,
                             const Vector3d& c) {
  const Vector3d ab = b - a;
  const Vector3d ac = c - a;
  const double d1 = ab.dot(p - a);
  const double d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return a;
  const double d3 = ab.dot(p - b);
  const double d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const double d5 = ab.dot(p - c);
  const double d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  }
  const double scale = 1 / (va + vb + vc);
  return a + vb * scale * ab + vc * scale * ac;
}

namespace {

template <class Value>
void put(std::string& bytes, Value value) {
  char raw[sizeof(Value)];
  std::memcpy(raw, &value, sizeof(Value));  // x86-64 only: little-endian
  bytes.append(raw, sizeof(Value));
}

}  // namespace

void Mesh::append(const Mesh& other, const Pose& placement) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  vertices.reserve(vertices.size() + other.vertices.size());
  triangles.reserve(triangles.size() + other.triangles.size());
  const std::size_t vertex_count = other.vertices.size();  // other may be *this
  const std::size_t triangle_count = other.triangles.size();
  for (std::size_t i = 0; i < vertex_count; ++i) vertices.push_back(placement * other.vertices[i]);
  for (std::size_t i = 0; i < triangle_count; ++i) {
    const auto& t = other.triangles[i];
    triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  const auto first_triangle = static_cast<std::uint32_t>(triangles.size() - triangle_count);
  const std::size_t group_count = other.groups.size();
  for (std::size_t i = 0; i < group_count; ++i) {
    MeshGroup group = other.groups[i];
    for (std::uint32_t& triangle : group.triangles) triangle += first_triangle;
    const auto same = std::find_if(groups.begin(), groups.end(),
                                   [&](const MeshGroup& g) { return g.name == group.name; });
    if (same == groups.end()) {
      groups.push_back(std::move(group));
    } else {
      same->triangles.insert(same->triangles.end(), group.triangles.begin(), group.triangles.end());
    }
  }
  faces_without_area += other.faces_without_area;
}

Mesh cut_out(const Mesh& mesh, const std::vector<std::uint32_t>& triangles) {
  Mesh own;
  std::unordered_map<std::uint32_t, std::uint32_t> places;
  for (const std::uint32_t i : triangles) {
    auto triangle = mesh.triangles[i];
    for (std::uint32_t& v : triangle) {
      const auto next = static_cast<std::uint32_t>(own.vertices.size());
      const auto [place, is_new] = places.try_emplace(v, next);
      if (is_new) own.vertices.push_back(mesh.vertices[v]);
      v = place->second;
    }
    own.triangles.push_back(triangle);
  }
  return own;
}

Box bounding_box(const Mesh& mesh) {
  if (mesh.vertices.empty()) return {};
  Box box{mesh.vertices.front(), mesh.vertices.front()};
  for (const auto& v : mesh.vertices) {
    box.low = box.low.cwiseMin(v);
    box.high = box.high.cwiseMax(v);
  }
  return box;
}

bool far_from_origin(const Box& box) {
  const double farthest = box.low.cwiseAbs().cwiseMax(box.high.cwiseAbs()).maxCoeff();
  return farthest > 16 * box.size().maxCoeff();
}

Mesh scaled_to_length(const Mesh& mesh, double length) {
  const double now = bounding_box(mesh).size().maxCoeff();
  if (!(now > 0)) throw InputError("a mesh without extent cannot be scaled to a length");
  Mesh scaled = mesh;
  for (auto& v : scaled.vertices) v *= length / now;
  return scaled;
}

std::string content_hash(const Mesh& mesh) {
  std::string bytes;
  bytes.reserve(16 + mesh.vertices.size() * 24 + mesh.triangles.size() * 12);
  put<std::uint64_t>(bytes, mesh.vertices.size());
  put<std::uint64_t>(bytes, mesh.triangles.size());
  for (const auto& v : mesh.vertices) {
    for (int i = 0; i < 3; ++i) put<double>(bytes, v[i] + 0.0);  // -0 and 0 are one place
  }
  for (const auto& t : mesh.triangles) {
    for (const std::uint32_t index : t) put<std::uint32_t>(bytes, index);
  }
  return sha256(bytes);
}

void save_ply(const Mesh& mesh, const std::filesystem::path& path) {
  std::string bytes = "ply\nformat binary_little_endian 1.0\ncomment units metres\ncomment " +
                      std::string(vertices_as_numbered) + "\nelement vertex " +
                      std::to_string(mesh.vertices.size()) +
                      "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                      std::to_string(mesh.triangles.size()) +
                      "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& v : mesh.vertices) {
    for (int i = 0; i < 3; ++i) put<double>(bytes, v[i]);
  }
  for (const auto& t : mesh.triangles) {
    put<std::uint8_t>(bytes, 3);
    for (const std::uint32_t index : t) put<std::int32_t>(bytes, static_cast<std::int32_t>(index));
  }
  std::ofstream out(path, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw InputError(path.string() + ": cannot be written");
}

Mesh make_box(const Vector3d& size) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5,
                          (i & 4) != 0 ? 0.5 : -0.5);
    mesh.vertices.emplace_back(corner.cwiseProduct(size));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

Mesh make_cylinder(double radius, double height, int sides, bool capped) {
  if (sides < 3) throw std::invalid_argument("a cylinder needs at least 3 sides");
  Mesh mesh;
  const auto n = static_cast<std::uint32_t>(sides);
  for (const double z : {-0.5 * height, 0.5 * height}) {
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = radians(360.0 * i / n);
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + i});
    mesh.triangles.push_back({j, n + j, n + i});
  }
  if (!capped) return mesh;
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    mesh.triangles.push_back({0, i + 1, i});
    mesh.triangles.push_back({n, n + i, n + i + 1});
  }
  return mesh;
}

Mesh make_strut(const Vector3d& a, const Vector3d& b, double diameter, int sides) {
  Pose placement;
  placement.position = 0.5 * (a + b);
  placement.rotation = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), b - a);
  Mesh mesh;
  mesh.append(make_cylinder(0.5 * diameter, (b - a).norm(), sides), placement);
  return mesh;
}

}  // namespace berth
