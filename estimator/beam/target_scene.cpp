// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/beam/target_scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace berth::estimator {

TargetScene::TargetScene(const Target& target)
    : vertices_(target.mesh.vertices), triangles_(target.mesh.triangles) {
  const std::size_t count = target.mesh.triangles.size();
  joint_of_.assign(count, -1);
  in_body_.resize(count);
  std::vector<int> joint_of_part(target.parts.size(), -1);
  for (std::size_t p = 0; p < target.parts.size(); ++p) {
    if (!target.parts[p].joint) continue;
    joint_of_part[p] = static_cast<int>(joints_.size());
    joints_.push_back(*target.parts[p].joint);
  }
  std::vector<std::vector<std::uint32_t>> faces(joints_.size() + 1);
  for (std::uint32_t f = 0; f < count; ++f) {
    const int joint = joint_of_part[target.part_index(f)];
    joint_of_[f] = static_cast<std::int8_t>(joint);
    in_body_[f] = static_cast<std::uint32_t>(faces[static_cast<std::size_t>(joint + 1)].size());
    faces[static_cast<std::size_t>(joint + 1)].push_back(f);
  }
  for (std::size_t b = 0; b < faces.size(); ++b) {
    if (!faces[b].empty()) add_body(target, static_cast<int>(b) - 1, faces[b]);
  }
}

void TargetScene::add_body(const Target& target, int joint,
                           const std::vector<std::uint32_t>& faces) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<Side>> edges;
  for (const std::uint32_t f : faces) {
    const auto& t = target.mesh.triangles[f];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto key = std::minmax(t[i], t[(i + 1) % 3]);
      edges[key].push_back({f, key.first == t[i]});
    }
  }
  Body body{joint, RayCaster(cut_out(target.mesh, faces)), faces, {}};
  for (const auto& [ends, sides] : edges) {
    body.edges.push_back({ends.first, ends.second, static_cast<std::uint32_t>(sides_.size()),
                          static_cast<std::uint32_t>(sides.size())});
    sides_.insert(sides_.end(), sides.begin(), sides.end());
  }
  bodies_.push_back(std::move(body));
}

double TargetScene::radius_about(const Vector3d& centre) const {
  double radius = 0;
  for (std::size_t f = 0; f < triangles_.size(); ++f) {
    for (const std::uint32_t v : triangles_[f]) {
      const Vector3d& vertex = vertices_[v];
      double apart = (vertex - centre).norm();
      if (joint_of_[f] >= 0) {
        // The maximum over a turn: vertex and centre on opposite sides of the axis.
        const Joint& joint = joints_[static_cast<std::size_t>(joint_of_[f])];
        const auto from_axis = [&joint](const Vector3d& p) {
          return (p - joint.point).cross(joint.axis).norm();
        };
        apart =
            std::hypot((vertex - centre).dot(joint.axis), from_axis(vertex) + from_axis(centre));
      }
      radius = std::max(radius, apart);
    }
  }
  return radius;
}

Pose TargetScene::placed(const Body& body, const std::vector<double>& angles) const {
  const auto j = static_cast<std::size_t>(body.joint);
  return body.joint < 0 ? Pose{} : turned(joints_[j], angles[j]);
}

void TargetScene::cast(const std::vector<double>& angles, std::span<const Ray> rays,
                       double max_range, std::span<SurfaceHit> hits) const {
  std::vector<RayHit> met(rays.size());
  std::vector<Ray> own;
  std::fill(hits.begin(), hits.end(), SurfaceHit{});
  for (const Body& body : bodies_) {
    const Pose model_body = placed(body, angles);
    std::span<const Ray> cast = rays;
    if (body.joint >= 0) {
      const Pose body_model = model_body.inverse();
      own.resize(rays.size());
      for (std::size_t i = 0; i < rays.size(); ++i) {
        own[i] = {body_model * rays[i].origin, body_model.rotation * rays[i].direction};
      }
      cast = own;
    }
    body.caster.cast(cast, max_range, met);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!(met[i].range < hits[i].range)) continue;
      hits[i] = {met[i].range,
                 body.joint < 0 ? met[i].normal : Vector3d(model_body.rotation * met[i].normal),
                 body.faces[met[i].triangle]};
    }
  }
}

SurfaceHit TargetScene::meet(const std::vector<double>& angles, const Ray& ray,
                             std::uint32_t face) const {
  const int joint = joint_of_[face];
  const Body* body = &bodies_.front();
  for (const Body& b : bodies_) {
    if (b.joint == joint) body = &b;
  }
  RayHit met;
  if (joint < 0) {
    body->caster.meet(ray, in_body_[face], met);
    return {met.range, met.normal, face};
  }
  const Pose model_body = placed(*body, angles);
  const Pose body_model = model_body.inverse();
  body->caster.meet({body_model * ray.origin, body_model.rotation * ray.direction}, in_body_[face],
                    met);
  return {met.range, model_body.rotation * met.normal, face};
}

std::vector<RimSample> TargetScene::rims(const std::vector<double>& angles, const Vector3d& eye,
                                         const Vector3d& axis, double cone_cosine, double spacing,
                                         double depth) const {
  struct Place {
    Vector3d point, outward;
  };
  std::vector<Place> places;
  // Signed volume of each triangle with the eye: the sign of its winding as seen from there.
  std::vector<double> seen(triangles_.size());
  for (const Body& body : bodies_) {
    const Pose model_body = placed(body, angles);
    const Vector3d from_eye = model_body.inverse() * eye;
    for (const std::uint32_t f : body.faces) {
      const auto& [i, j, k] = triangles_[f];
      const Vector3d a = vertices_[i] - from_eye;
      seen[f] = a.dot((vertices_[j] - from_eye).cross(vertices_[k] - from_eye));
    }
    for (const Edge& edge : body.edges) {
      int positive = 0;
      int negative = 0;
      for (std::uint32_t i = edge.first; i < edge.first + edge.count; ++i) {
        ((seen[sides_[i].triangle] > 0) == sides_[i].along ? positive : negative) += 1;
      }
      if (positive > 0 && negative > 0) continue;
      const Vector3d a = vertices_[edge.from] - from_eye;
      const Vector3d b = vertices_[edge.to] - from_eye;
      const Vector3d across = a.cross(b);
      const double length = across.norm();
      if (!(length > 0)) continue;
      const Vector3d outward = model_body.rotation * (across / (positive > 0 ? -length : length));
      const Vector3d start = model_body.rotation * a;
      const Vector3d along = model_body.rotation * (b - a);
      const double near = std::min(a.norm(), b.norm());
      const int pieces = static_cast<int>(std::ceil(along.norm() / (spacing * near)));
      for (int i = 0; i < pieces; ++i) {
        const Vector3d p = start + along * ((i + 0.5) / pieces);
        if (p.dot(axis) < cone_cosine * p.norm()) continue;
        places.push_back({eye + p, outward});
      }
    }
  }
  // A ray on either side of each point; `aside` is far below a beam's resolution.
  const double aside = 0.02 * depth;
  std::vector<Ray> rays(2 * places.size());
  std::vector<SurfaceHit> hits(rays.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& [point, outward] = places[i];
    rays[2 * i] = {eye, (point - aside * outward - eye).normalized()};
    rays[2 * i + 1] = {eye, (point + aside * outward - eye).normalized()};
  }
  cast(angles, rays, 1e9, hits);
  std::vector<RimSample> samples;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const SurfaceHit& in = hits[2 * i];
    const SurfaceHit& out = hits[2 * i + 1];
    const double range = (places[i].point - eye).norm();
    if (!in.met() || std::abs(in.range - range) > depth || out.range < range + depth) continue;
    samples.push_back({places[i].point, places[i].outward, in, out});
  }
  return samples;
}

}  // namespace berth::estimator
