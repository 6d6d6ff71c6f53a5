// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/plan/pose_information.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

#include "estimator/optimise/random_effects.h"
#include "estimator/plan/optimal_design.h"

namespace berth::estimator {

PoseView::PoseView(const TargetModel& model, const TargetScene* scene, const BeamModel& beam,
                   const PlannerOptions& options, const Pose& pose)
    : model_(model),
      beam_(beam),
      to_model_(pose.inverse()),
      rotation_(to_model_.rotation.toRotationMatrix()),
      far_(std::min(beam.range_max_m, (model.centre - to_model_.position).norm() + model.radius)),
      options_(options),
      range_(std::max(beam.range_min_m, (pose * model.centre).norm())) {
  if (scene != nullptr) sample_edges(*scene);
  place_edges(pose);
}

void PoseView::sample_edges(const TargetScene& scene) {
  constexpr double pieces_across = 40;
  constexpr double edge_information = 1.806;  // integral of phi^2 / (Phi (1 - Phi))
  const Vector3d eye = to_model_.position;
  const double spacing = 2 * model_.radius / (pieces_across * range_);
  const double cone = std::min(1.0, model_.radius / range_);
  const std::vector<double> angles(scene.joints().size(), 0);
  for (const RimSample& rim : scene.rims(angles, eye, (model_.centre - eye).normalized(),
                                         std::sqrt(1 - cone * cone) - 1e-6, spacing, edge_depth)) {
    const TargetPart& part = model_.target.part(rim.front.face);
    if (part.scan == ScanPreference::avoid) continue;
    const double range = (rim.point - eye).norm();
    const double weight =
        edge_information * spacing * range / std::sqrt(beam_.edge_variance(range));
    EdgePiece& piece = edges_.emplace_back();
    piece.point = rim.point;
    piece.root << rim.outward, rim.point.cross(rim.outward) / model_.canonical.half_length;
    piece.root *= std::sqrt(weight);
    const double surface = surface_sigma(part);
    piece.correlation = surface * surface * weight;
    piece.patch = 1 + 2 * cell_of(rim.point, part.correlation_length);
  }
}

void PoseView::place_edges(const Pose& pose) {
  edge_angles_.resize(edges_.size());
  for (std::size_t i = 0; i < edges_.size(); ++i) {
    beam_angles(pose * edges_[i].point, edge_angles_[i][0], edge_angles_[i][1]);
  }
}

PoseView PoseView::moved_to(const Pose& pose) const {
  PoseView view(model_, nullptr, beam_, options_, pose);
  view.edges_ = edges_;
  view.place_edges(pose);
  return view;
}

double PoseView::surface_sigma(const TargetPart& part) const {
  if (part.scan == ScanPreference::prefer) return 0;
  return model_.target.surface_sigma(part, options_.bare_surface_sigma_m);
}

void PoseView::returns(std::span<const Vector3d> directions, std::span<BeamReturn> returns) const {
  constexpr std::size_t chunk = 64;  // beams at a time, on the stack
  const double angle_variance = beam_.angle_variance();
  const double range_variance = beam_.range_sigma_m * beam_.range_sigma_m;
  std::array<Ray, chunk> rays;
  std::array<RayHit, chunk> hits;
  for (std::size_t first = 0; first < directions.size(); first += chunk) {
    const std::size_t count = std::min(chunk, directions.size() - first);
    for (std::size_t i = 0; i < count; ++i) {
      rays[i] = {to_model_.position, rotation_ * directions[first + i]};
    }
    model_.caster.cast({rays.data(), count}, far_, hits);
    for (std::size_t i = 0; i < count; ++i) {
      const RayHit& hit = hits[i];
      BeamReturn& beam = returns[first + i];
      beam = {};
      if (!std::isfinite(hit.range) || hit.range < beam_.range_min_m) continue;
      const Vector3d& direction = rays[i].direction;
      const double cosine = std::min(1.0, -direction.dot(hit.normal));
      if (cosine < options_.min_cosine) continue;
      beam.met = true;
      const TargetPart& part = model_.target.part(hit.triangle);
      if (part.scan == ScanPreference::avoid) continue;
      // Across the surface; BeamModel's variance of the range is that over cosine^2.
      const double variance = cosine * cosine * range_variance +
                              hit.range * hit.range * (1 - cosine * cosine) * angle_variance;
      const Vector3d arm = to_model_.position + hit.range * direction;
      beam.root << hit.normal, arm.cross(hit.normal) / model_.canonical.half_length;
      beam.root /= std::sqrt(variance);
      const double surface = surface_sigma(part);
      beam.correlation = surface * surface / variance;
      beam.patch_area = part.correlation_length * part.correlation_length;
      beam.patch = 2 * cell_of(arm, part.correlation_length);
    }
  }
}

Matrix6d PoseView::pose_covariance(const Matrix6d& scaled) const {
  Matrix6d to_sensor = Matrix6d::Zero();
  to_sensor.topLeftCorner<3, 3>() = rotation_.transpose();
  to_sensor.bottomRightCorner<3, 3>() = rotation_.transpose() / model_.canonical.half_length;
  return to_sensor * scaled * to_sensor.transpose();
}

Matrix6d scan_information(const PoseView& view, const std::vector<Window>& windows, int* returns) {
  std::vector<Vector3d> directions;
  for (const Window& window : windows) append_raster(window, directions);
  std::vector<BeamReturn> beams(directions.size());
  view.returns(directions, beams);
  struct Patch {
    PackedMatrix sum = PackedMatrix::Zero();
    double correlation = 0;
  };
  std::unordered_map<std::uint64_t, Patch> patches;
  int count = 0;
  for (const BeamReturn& beam : beams) {
    if (beam.met) ++count;
    if (beam.root.isZero(0)) continue;
    Patch& patch = patches[beam.patch];
    patch.sum += packed_square(beam.root);
    patch.correlation += beam.correlation;
  }
  for (const Window& window : windows) {
    const double density = window.count / view.area(window);
    view.edges_in(window, [&](std::size_t i) {
      const EdgePiece& edge = view.edges()[i];
      Patch& patch = patches[edge.patch];
      patch.sum += density * packed_square(edge.root);
      patch.correlation += density * edge.correlation;
    });
  }
  PackedMatrix information = PackedMatrix::Zero();
  for (const auto& [key, patch] : patches) information += patch.sum / (1 + patch.correlation);
  if (returns != nullptr) *returns = count;
  return unpacked(information);
}

}  // namespace berth::estimator
