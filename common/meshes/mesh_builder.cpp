// SPDX-License-Identifier: BSD-3-Clause
#include "common/meshes/mesh_builder.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

#include "common/core/error.h"
#include "common/meshes/polygon.h"

namespace berth {
namespace {

constexpr std::uint32_t not_yet = std::numeric_limits<std::uint32_t>::max();

bool without_area(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const double edge =
      std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
  return (b - a).cross(c - a).norm() <= 1e-9 * edge;
}

}  // namespace

std::size_t MeshBuilder::PlaceHash::operator()(const std::array<double, 3>& place) const {
  std::uint64_t hash = 0;
  for (const double v : place) {  // as in MurmurHash3's finaliser
    hash = (hash ^ std::bit_cast<std::uint64_t>(v)) * 0xff51afd7ed558ccdULL;
    hash ^= hash >> 33;
  }
  return hash;
}

std::string MeshBuilder::add_vertex(const Vector3d& vertex) {
  // areas and volumes must be numbers too
  constexpr double too_far = 1e100;
  if (!vertex.allFinite()) return "a coordinate is not finite";
  if (vertex.cwiseAbs().maxCoeff() > too_far) return "a coordinate is beyond 1e100";
  if (file_vertices_.size() == not_yet) return "more vertices than 32 bits can number";
  file_vertices_.push_back(vertex);
  welded_.push_back(not_yet);
  return {};
}

void MeshBuilder::set_groups(const std::vector<std::string>& names) {
  groups_.clear();
  for (const std::string& name : names) {
    const auto [place, fresh] = group_index_.try_emplace(name, mesh_.groups.size());
    if (fresh) mesh_.groups.push_back({name, {}});
    if (std::find(groups_.begin(), groups_.end(), place->second) == groups_.end()) {
      groups_.push_back(place->second);
    }
  }
}

std::string MeshBuilder::add_face(std::span<const std::uint32_t> corners) {
  if (corners.empty()) return "a face without corners";
  bool any = false;
  if (corners.size() == 3) {
    any = add_triangle(corners[0], corners[1], corners[2]);
  } else {
    polygon_.clear();
    for (const std::uint32_t corner : corners) polygon_.push_back(file_vertices_[corner]);
    pieces_.clear();
    if (!triangulate(polygon_, pieces_)) {
      return "a face of " + std::to_string(corners.size()) +
             " corners crosses itself, expected an outline that does not (or triangles)";
    }
    for (const auto& piece : pieces_) {
      any |= add_triangle(corners[piece[0]], corners[piece[1]], corners[piece[2]]);
    }
  }
  if (!any) ++mesh_.faces_without_area;
  return {};
}

std::uint32_t MeshBuilder::welded(std::uint32_t file_vertex) {
  if (keeps_numbering_) return file_vertex;
  std::uint32_t& known = welded_[file_vertex];
  if (known != not_yet) return known;
  const Vector3d& v = file_vertices_[file_vertex];
  const auto next = static_cast<std::uint32_t>(mesh_.vertices.size());
  // -0 and 0 are one place
  const auto [place, fresh] = index_.try_emplace({v.x() + 0.0, v.y() + 0.0, v.z() + 0.0}, next);
  if (fresh) mesh_.vertices.push_back(v);
  return known = place->second;
}

bool MeshBuilder::add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  if (without_area(file_vertices_[a], file_vertices_[b], file_vertices_[c])) return false;
  const auto index = static_cast<std::uint32_t>(mesh_.triangles.size());
  for (const std::size_t group : groups_) mesh_.groups[group].triangles.push_back(index);
  // one after the other: the order of the vertices is part of the content
  const std::uint32_t first = welded(a);
  const std::uint32_t second = welded(b);
  mesh_.triangles.push_back({first, second, welded(c)});
  return true;
}

Mesh MeshBuilder::take(const std::string& file) {
  if (mesh_.triangles.empty()) {
    throw InputError(file + ": holds no triangle" +
                     (mesh_.faces_without_area > 0
                          ? ": " + std::to_string(mesh_.faces_without_area) + " faces without area"
                          : ""));
  }
  if (keeps_numbering_) mesh_.vertices = std::move(file_vertices_);
  std::erase_if(mesh_.groups, [](const MeshGroup& group) { return group.triangles.empty(); });
  return std::move(mesh_);
}

}  // namespace berth
