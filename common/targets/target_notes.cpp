// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/text.h"
#include "common/targets/target.h"

namespace berth {
namespace {

constexpr double max_spacecraft = 109;   // m: the International Space Station's truss
constexpr double min_spacecraft = 0.03;  // m: KickSat's Sprites were 35 mm wide
const char* const length_remedy = "give its length in m (--length, --target-length)";

/// Largest distance of vertices from the plane that fits them best, m.
double thickness(const Mesh& mesh, const Vector3d& centre) {
  Matrix3d spread = Matrix3d::Zero();
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& v : mesh.vertices) mean += v - centre;
  mean /= static_cast<double>(mesh.vertices.size());
  for (const Vector3d& v : mesh.vertices) {
    const Vector3d d = v - centre - mean;
    spread += d * d.transpose();
  }
  const Vector3d normal = Eigen::SelfAdjointEigenSolver<Matrix3d>(spread).eigenvectors().col(0);
  double max_distance = 0;
  for (const Vector3d& v : mesh.vertices) {
    max_distance = std::max(max_distance, std::abs(normal.dot(v - centre - mean)));
  }
  return max_distance;
}

/// Triangles of closed surfaces that look inward: those surfaces, of triangles joined by edges,
/// whose edges are all passed as often in one direction as in the other, and whose volume is
/// negative (divergence theorem).
std::size_t inward_triangles(const Mesh& mesh, const Vector3d& centre) {
  // Surfaces by their vertices: each vertex names another one of the same surface, or itself.
  std::vector<std::uint32_t> surface(mesh.vertices.size());
  std::iota(surface.begin(), surface.end(), 0U);
  const auto surface_of = [&](std::uint32_t v) {
    while (surface[v] != v) v = surface[v] = surface[surface[v]];
    return v;
  };
  struct Edge {
    std::uint32_t low, high;
    int direction;
  };
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i];
      const std::uint32_t b = t[(i + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
      surface[surface_of(a)] = surface_of(b);
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  std::vector<bool> open(mesh.vertices.size());
  for (std::size_t i = 0; i < edges.size();) {
    int sum = 0;
    const Edge& first = edges[i];
    for (; i < edges.size() && edges[i].low == first.low && edges[i].high == first.high; ++i) {
      sum += edges[i].direction;
    }
    if (sum != 0) open[surface_of(first.low)] = true;
  }
  std::vector<double> volume(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices[t[0]] - centre;
    const Vector3d b = mesh.vertices[t[1]] - centre;
    const Vector3d c = mesh.vertices[t[2]] - centre;
    volume[surface_of(t[0])] += a.dot(b.cross(c)) / 6;
  }
  return static_cast<std::size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
        const std::uint32_t s = surface_of(t[0]);
        return !open[s] && volume[s] < 0;
      }));
}

}  // namespace

std::vector<std::string> target_notes(const Target& target) {
  std::vector<std::string> notes;
  const Mesh& mesh = target.mesh;
  const Box box = bounding_box(mesh);
  if (target.length > max_spacecraft || target.length < min_spacecraft) {
    notes.push_back("it is " + shown(target.length) + " m long, and spacecraft are from " +
                    shown(min_spacecraft) + " to " + shown(max_spacecraft) +
                    " m: is it in mm or another unit? Then " + length_remedy);
  }
  if (target.file_origin != Vector3d::Zero()) {
    const Vector3d& at = target.file_origin;
    // a float has 24 digits
    const double apart = std::ldexp(1.0, std::ilogb(at.cwiseAbs().maxCoeff()) - 23);
    notes.push_back(
        "its origin is " + fixed(at.norm(), 0) +
        " m away: it is taken about the centre of its bounding box, x y z = " + fixed(at.x(), 3) +
        " " + fixed(at.y(), 3) + " " + fixed(at.z(), 3) +
        " of the file, and poses are of that point; there the numbers of binary STL and "
        "'float' PLY are " +
        shown(apart) + " m apart: move it to its origin before it is written so");
  } else {
    const double away = (-box.low).cwiseMin(box.high).cwiseMin(0).norm();
    if (away > target.length) {
      notes.push_back(
          "its origin is " + shown(away) + " m outside of it, and it is " + shown(target.length) +
          " m long: poses are of that origin; move it into the mesh if that is not meant");
    }
  }
  // Corners are written in 32 bits by most programs.
  if (thickness(mesh, box.centre()) < 1e-6 * target.length) {
    notes.push_back(
        "all of it lies in one plane: turned about its normal or seen from behind it "
        "looks much the same; is a part missing?");
  }
  if (const std::size_t inward = inward_triangles(mesh, box.centre());
      2 * inward > mesh.triangles.size()) {
    notes.push_back("its surface is inside out: " + std::to_string(inward) + " of " +
                    std::to_string(mesh.triangles.size()) +
                    " triangles look inward; both sides are used here, other programs may not");
  }
  if (mesh.faces_without_area > 0) {
    notes.push_back(std::to_string(mesh.faces_without_area) +
                    " faces without area were left out, " + std::to_string(mesh.triangles.size()) +
                    " triangles were kept");
  }
  return notes;
}

}  // namespace berth
