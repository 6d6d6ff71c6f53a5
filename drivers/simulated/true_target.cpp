// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/true_target.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "common/core/random.h"
#include "common/core/ray_caster.h"

namespace berth {

SmoothField::SmoothField(Random random, double length) {
  for (Feature& f : features_) {
    f.frequency = random.normal_vector(1 / length);
    f.phase = random.uniform(0, radians(360));
    f.amplitude = random.normal_vector(std::sqrt(2.0 / count));
  }
}

Vector3d SmoothField::at(const Vector3d& x) const {
  Vector3d sum = Vector3d::Zero();
  for (const Feature& f : features_) sum += std::cos(f.frequency.dot(x) + f.phase) * f.amplitude;
  return sum;
}

namespace {

using Triangle = std::array<std::uint32_t, 3>;

double area_of(const Mesh& mesh, const Triangle& t) {
  const Vector3d& a = mesh.vertices[t[0]];
  return 0.5 * (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).norm();
}

/// Indices of vertices in one place are one.
std::vector<std::uint32_t> merged_vertices(const Mesh& mesh) {
  std::map<std::array<double, 3>, std::uint32_t> places;
  std::vector<std::uint32_t> merged;
  for (const Vector3d& v : mesh.vertices) {
    const auto next = static_cast<std::uint32_t>(places.size());
    merged.push_back(places.try_emplace({v.x(), v.y(), v.z()}, next).first->second);
  }
  return merged;
}

/// Parts triangles at the middle of their longest edge until no edge is longer than this, m: both
/// sides of an edge alike, so that no gap opens. part_of goes along.
void refine(Mesh& mesh, std::vector<std::uint16_t>& part_of, double max_edge) {
  constexpr double enough = 200000;  // triangles
  const auto length = [&](std::uint32_t a, std::uint32_t b) {
    return (mesh.vertices[a] - mesh.vertices[b]).norm();
  };
  const auto expected = [&] {
    double sum = 0;
    for (const Triangle& t : mesh.triangles) {
      const double around = length(t[0], t[1]) + length(t[1], t[2]) + length(t[2], t[0]);
      sum += 1 + 6 * area_of(mesh, t) / (max_edge * max_edge) + around / max_edge;
    }
    return sum;
  };
  while (expected() > enough + 2 * static_cast<double>(mesh.triangles.size())) max_edge *= 1.2;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  for (std::size_t i = 0; i < mesh.triangles.size();) {
    const Triangle t = mesh.triangles[i];
    std::size_t k = 0;  // where the longest edge begins
    for (std::size_t e = 1; e < 3; ++e) {
      if (length(t[e], t[(e + 1) % 3]) > length(t[k], t[(k + 1) % 3])) k = e;
    }
    const std::uint32_t a = t[k];
    const std::uint32_t b = t[(k + 1) % 3];
    const std::uint32_t c = t[(k + 2) % 3];
    if (length(a, b) <= max_edge) {
      ++i;
      continue;
    }
    const auto next = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto [middle, fresh] = middles.try_emplace(std::minmax(a, b), next);
    if (fresh) mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    mesh.triangles[i] = {a, middle->second, c};
    mesh.triangles.push_back({middle->second, b, c});
    part_of.push_back(part_of[i]);
  }
}

double sigma_of(const TargetPart& part, const TargetDepartures& departures) {
  const auto& instead =
      part.scan == ScanPreference::avoid ? departures.soft_surface : departures.rigid_surface;
  return instead.value_or(departures.surface * part.surface_sigma);
}

/// Displaces the surface of truth.target by the amounts of its parts.
void displace(TrueTarget& truth, std::uint64_t seed) {
  Target& target = truth.target;
  double shortest = std::numeric_limits<double>::infinity();
  std::vector<std::optional<SmoothField>> fields(truth.parts.size());
  for (std::size_t i = 0; i < truth.parts.size(); ++i) {
    const TrueTarget::Part& part = truth.parts[i];
    if (!(part.sigma > 0)) continue;
    fields[i].emplace(Random(seed, "surface of " + part.name), part.correlation_length);
    shortest = std::min(shortest, part.correlation_length);
  }
  if (!std::isfinite(shortest)) return;
  Mesh& mesh = target.mesh;
  mesh.groups.clear();
  refine(mesh, target.part_of, 0.5 * shortest);
  const std::vector<std::uint32_t> place = merged_vertices(mesh);
  std::vector<std::pair<std::uint32_t, std::uint16_t>> parts_at;  // of each place
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t v : mesh.triangles[i]) {
      parts_at.emplace_back(place[v], target.part_of[i]);
    }
  }
  std::sort(parts_at.begin(), parts_at.end());
  parts_at.erase(std::unique(parts_at.begin(), parts_at.end()), parts_at.end());
  std::vector<Vector3d> shifts(mesh.vertices.size(), Vector3d::Zero());  // of places
  std::vector<int> shared(mesh.vertices.size(), 0);
  std::vector<std::uint32_t> vertex_at(mesh.vertices.size(), 0);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    vertex_at[place[v]] = static_cast<std::uint32_t>(v);
  }
  for (const auto& [at, part] : parts_at) {
    ++shared[at];
    if (fields[part]) {
      shifts[at] += truth.parts[part].sigma * fields[part]->at(mesh.vertices[vertex_at[at]]);
    }
  }
  for (std::size_t at = 0; at < shifts.size(); ++at) shifts[at] /= std::max(1, shared[at]);

  std::vector<double> area(truth.parts.size(), 0);
  std::vector<double> square(truth.parts.size(), 0);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const Vector3d& a = mesh.vertices[t[0]];
    const Vector3d normal =
        (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);  // twice the area long
    if (!(normal.norm() > 0)) continue;
    const double along =
        (shifts[place[t[0]]] + shifts[place[t[1]]] + shifts[place[t[2]]]).dot(normal.normalized()) /
        3;
    area[target.part_of[i]] += normal.norm();
    square[target.part_of[i]] += normal.norm() * along * along;
  }
  for (std::size_t i = 0; i < truth.parts.size(); ++i) {
    if (area[i] > 0) truth.parts[i].rms = std::sqrt(square[i] / area[i]);
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) mesh.vertices[v] += shifts[place[v]];
}

void turn_joints(TrueTarget& truth, double range, std::uint64_t seed) {
  if (!(range > 0)) return;
  std::vector<double> angles;
  for (TrueTarget::Part& part : truth.parts) {
    Random random(seed, "joint of " + part.name);
    const double angle = random.uniform(-range, range);
    if (const auto& joint = truth.target.parts[angles.size()].joint) {
      part.angle = std::clamp(angle, joint->low - joint->rest, joint->high - joint->rest);
    }
    angles.push_back(part.angle);
  }
  truth.target.mesh = turned_mesh(truth.target, angles);
}

/// Parts that may be missing: each described one, and each connected piece of the default part;
/// index by triangle.
std::vector<std::size_t> removable_pieces(const Target& target, std::vector<std::string>& names) {
  const Mesh& mesh = target.mesh;
  const std::vector<std::uint32_t> place = merged_vertices(mesh);
  std::vector<std::uint32_t> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](std::uint32_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (target.part_of[i] != 0) continue;
    for (const std::uint32_t v : mesh.triangles[i]) {
      root[find(place[v])] = find(place[mesh.triangles[i][0]]);
    }
  }
  for (const TargetPart& part : target.parts) names.push_back(part.name);
  std::map<std::uint32_t, std::size_t> pieces;  // of the default part, by root
  std::vector<std::size_t> piece_of;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (target.part_of[i] != 0) {
      piece_of.push_back(target.part_of[i]);
      continue;
    }
    const auto [piece, fresh] = pieces.try_emplace(find(place[mesh.triangles[i][0]]), names.size());
    if (fresh) names.push_back("piece " + std::to_string(pieces.size()));
    piece_of.push_back(piece->second);
  }
  return piece_of;
}

/// Removes one piece of at least a fiftieth of the surface, so that at least half of it is left.
void remove_part(TrueTarget& truth, Random& random) {
  Mesh& mesh = truth.target.mesh;
  std::vector<std::string> names;
  const std::vector<std::size_t> piece_of = removable_pieces(truth.target, names);
  std::vector<double> area(names.size(), 0);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    area[piece_of[i]] += area_of(mesh, mesh.triangles[i]);
  }
  const double all = std::accumulate(area.begin(), area.end(), 0.0);
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (area[i] >= 0.02 * all && area[i] <= 0.5 * all) candidates.push_back(i);
  }
  const double draw = random.uniform() * static_cast<double>(candidates.size());
  if (candidates.empty()) return;
  const std::size_t gone = candidates[static_cast<std::size_t>(draw)];
  truth.missing = names[gone];
  mesh.groups.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < piece_of.size(); ++i) {
    if (piece_of[i] == gone) continue;
    mesh.triangles[kept] = mesh.triangles[i];
    truth.target.part_of[kept++] = truth.target.part_of[i];
  }
  mesh.triangles.resize(kept);
  truth.target.part_of.resize(kept);
}

/// Puts a box on the surface: at a random place of its area, turned at random about the normal.
void add_part(TrueTarget& truth, double size, Random& random) {
  Mesh& mesh = truth.target.mesh;
  double all = 0;
  for (const Triangle& t : mesh.triangles) all += area_of(mesh, t);
  double left = random.uniform() * all;
  std::size_t i = 0;
  while (i + 1 < mesh.triangles.size() && left > area_of(mesh, mesh.triangles[i])) {
    left -= area_of(mesh, mesh.triangles[i++]);
  }
  const Triangle& t = mesh.triangles[i];
  const Vector3d& a = mesh.vertices[t[0]];
  const Vector3d ab = mesh.vertices[t[1]] - a;
  const Vector3d ac = mesh.vertices[t[2]] - a;
  const double u = std::sqrt(random.uniform());
  const double v = random.uniform();
  const Vector3d foot = a + u * (1 - v) * ab + u * v * ac;
  Vector3d normal = ab.cross(ac).normalized();
  const double turn = random.uniform(0, radians(360));
  for (int axis = 0; axis < 3; ++axis) truth.extra_size[axis] = random.uniform(0.25, 1) * size;
  // Winding is not reliable: outwards is the side without further hits, else away from the middle.
  const RayCaster caster(mesh);
  const double start = 1e-4 * size;
  const auto follows = [&](const Vector3d& d) {
    return caster.occluded({foot + start * d, d}, 1e6);
  };
  const bool inwards = follows(normal) != follows(-normal)
                           ? follows(normal)
                           : normal.dot(foot - bounding_box(mesh).centre()) < 0;
  if (inwards) normal = -normal;
  truth.extra.rotation = Quaterniond::FromTwoVectors(Vector3d::UnitZ(), normal) *
                         rotation_from_vector(turn * Vector3d::UnitZ());
  truth.extra.position = foot + 0.45 * truth.extra_size.z() * normal;  // a twentieth sunk in
  mesh.append(make_box(truth.extra_size), truth.extra);
  TargetPart part;
  part.name = "one too many";
  truth.target.parts.push_back(part);
  truth.target.part_of.resize(mesh.triangles.size(),
                              static_cast<std::uint16_t>(truth.target.parts.size() - 1));
}

}  // namespace

TargetDepartures read_target_departures(Config config) {
  TargetDepartures departures;
  config.optional("surface", departures.surface, at_least(0));
  config.optional("rigid_surface", Dimension::length, departures.rigid_surface, at_least(0));
  config.optional("soft_surface", Dimension::length, departures.soft_surface, at_least(0));
  config.optional("joints", Dimension::angle, departures.joints, at_least(0));
  config.optional("missing", departures.missing, within(0, 1));
  config.optional("extra", departures.extra, within(0, 1));
  config.optional("extra_size", departures.extra_size, within(0, 1));
  config.finish();
  return departures;
}

TrueTarget draw_true_target(const Target& described, const TargetDepartures& departures,
                            std::uint64_t seed) {
  TrueTarget truth;
  truth.target = described;
  Target& target = truth.target;
  for (const TargetPart& part : described.parts) {
    truth.parts.push_back({part.name, sigma_of(part, departures), part.correlation_length});
  }
  if (target.part_of.empty()) target.part_of.assign(target.mesh.triangles.size(), 0);
  Random random(seed, "parts of the target");
  const double odd = random.uniform();
  if (odd < departures.missing) remove_part(truth, random);
  displace(truth, seed);
  turn_joints(truth, departures.joints, seed);
  if (odd >= 1 - departures.extra)
    add_part(truth, departures.extra_size * described.length, random);
  return truth;
}

}  // namespace berth
