// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/text.h"
#include "procedures/check/check.h"

namespace berth::procedures {
namespace {

/// Points that the surface is covered with.
constexpr int max_points = 3000;
/// Places of a step at which the sensor looks.
constexpr std::size_t looks = 8;
/// Visible share of the replica below which an acquisition may fail, and tracking gets a warning.
constexpr double share_to_see = 0.5;

/// Even over each triangle, the more the larger it is, and at least one.
std::vector<Vector3d> cover(const Mesh& mesh) {
  const auto corners = [&mesh](const auto& triangle) {
    return std::array<Vector3d, 3>{mesh.vertices[triangle[0]], mesh.vertices[triangle[1]],
                                   mesh.vertices[triangle[2]]};
  };
  double area = 0;
  for (const auto& triangle : mesh.triangles) {
    const auto [a, b, c] = corners(triangle);
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  std::vector<Vector3d> points;
  for (const auto& triangle : mesh.triangles) {
    const auto [a, b, c] = corners(triangle);
    const double share = 0.5 * (b - a).cross(c - a).norm() / area;
    const int n = std::max(1, static_cast<int>(std::lround(std::sqrt(share * max_points))));
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        points.push_back(a + (i + 1.0 / 3) / n * (b - a) + (j + 1.0 / 3) / n * (c - a));
      }
    }
  }
  return points;
}

std::string percent(double share) { return fixed(100 * share, 0) + " %"; }

/// Visibility of the replica from the LIDAR's place.
struct Visibility {
  double share = 0;     ///< of the surface turned to the sensor that can be measured
  double outside = 0;   ///< of it: beyond the field of view,
  double too_near = 0;  ///<   nearer than the LIDAR's least range or the gate,
  double too_far = 0;   ///<   farther than its greatest range or the gate
  double nearest = 0;   ///< m, of that surface
  double farthest = 0;
};

/// Looks at the target from the sensor's place, ray by ray.
class VisibilityModel {
 public:
  explicit VisibilityModel(const Rig& rig);
  Visibility look(const Pose& pose, const estimator::RangeGate& gate) const;

 private:
  const Rig& rig_;
  std::vector<Vector3d> points_;  // of the surface, evenly spread, model frame
};

/// The cause that hides most of the replica.
std::string hindrance(const Visibility& visibility, const Rig& rig,
                      const estimator::RangeGate& gate) {
  const LidarProfile& lidar = rig.lidar;
  if (visibility.outside >= visibility.too_near && visibility.outside >= visibility.too_far) {
    return "the rest lies outside its field of view of " +
           fixed(degrees(lidar.field_of_view_width), 0) + " x " +
           fixed(degrees(lidar.field_of_view_height), 0) + " deg";
  }
  const std::string lies = "it lies " + fixed(visibility.nearest, 2) + " m to " +
                           fixed(visibility.farthest, 2) + " m away, ";
  if (visibility.too_near >= visibility.too_far) {
    return lies + (gate.near > lidar.beam.range_min_m
                       ? "the gate begins at " + fixed(gate.near, 2) + " m"
                       : "its least range is " + fixed(lidar.beam.range_min_m, 2) + " m");
  }
  return lies + (gate.far < lidar.beam.range_max_m
                     ? "the gate ends at " + fixed(gate.far, 2) + " m"
                     : "its greatest range is " + fixed(lidar.beam.range_max_m, 0) + " m");
}

VisibilityModel::VisibilityModel(const Rig& rig)
    : rig_(rig), points_(cover(rig.cell.target.mesh)) {}

Visibility VisibilityModel::look(const Pose& pose, const estimator::RangeGate& gate) const {
  const LidarProfile& lidar = rig_.lidar;
  const Vector3d eye = pose.inverse().position;
  const double min_range = std::max(gate.near, lidar.beam.range_min_m);
  const double greatest = std::min(gate.far, lidar.beam.range_max_m);
  Visibility visibility;
  visibility.nearest = std::numeric_limits<double>::infinity();
  int turned_here = 0;
  for (const Vector3d& point : points_) {
    const Vector3d way = point - eye;
    const double range = way.norm();
    constexpr double skin = 1e-3;
    if (range <= skin || rig_.surface.occluded({eye, way / range}, range - skin)) continue;
    ++turned_here;
    visibility.nearest = std::min(visibility.nearest, range);
    visibility.farthest = std::max(visibility.farthest, range);
    const Vector3d seen = pose * point;
    const double azimuth = std::atan2(seen.x(), seen.z());
    const double elevation = std::atan2(-seen.y(), std::hypot(seen.x(), seen.z()));
    if (std::abs(azimuth) > 0.5 * lidar.field_of_view_width ||
        std::abs(elevation) > 0.5 * lidar.field_of_view_height) {
      ++visibility.outside;
    } else if (range < min_range) {
      ++visibility.too_near;
    } else if (range > greatest) {
      ++visibility.too_far;
    } else {
      ++visibility.share;
    }
  }
  for (double* count :
       {&visibility.share, &visibility.outside, &visibility.too_near, &visibility.too_far}) {
    *count /= std::max(1, turned_here);
  }
  return visibility;
}

}  // namespace

std::vector<Finding> check_visibility(const Procedure& procedure, const Rig& rig,
                                      const Rehearsal& rehearsal) {
  std::vector<Finding> findings;
  const VisibilityModel model(rig);
  const auto& moments = rehearsal.moments();
  estimator::RangeGate gate = rig.estimator.gate;
  for (std::size_t i = 0; i < rehearsal.steps().size(); ++i) {
    const StepForecast& forecast = rehearsal.steps()[i];
    const Verb& verb = procedure.steps[i].verb;
    const auto* acquire = std::get_if<Acquire>(&verb);
    const auto* track = std::get_if<Track>(&verb);
    const double near = acquire != nullptr ? acquire->gate_near
                        : track != nullptr ? track->gate_near
                                           : 0;
    const double far = acquire != nullptr ? acquire->gate_far
                       : track != nullptr ? track->gate_far
                                          : 0;
    if (acquire != nullptr || track != nullptr) gate = rig.estimator.gate;
    if (far > 0) gate = {near, far};
    if (acquire == nullptr && !moments[forecast.last_moment].tracked) continue;
    const std::size_t stride =
        std::max<std::size_t>(1, (forecast.last_moment - forecast.first_moment) / looks);
    Visibility worst;
    double when = 0;
    worst.share = 2;
    for (std::size_t k = forecast.moves ? forecast.first_moment : forecast.last_moment;
         k <= forecast.last_moment; k += stride) {
      const Visibility visibility = model.look(moments[k].pose, gate);
      if (visibility.share >= worst.share) continue;
      worst = visibility;
      when = moments[k].time - forecast.start;
    }
    if (worst.share >= share_to_see) continue;
    Finding finding;
    finding.severity = worst.share <= 0     ? Severity::error
                       : acquire != nullptr ? Severity::warning
                                            : Severity::note;
    finding.file = procedure.steps[i].file;
    finding.line = forecast.line;
    finding.key = "step '" + forecast.name + "'";
    finding.found = "the LIDAR " + rig.lidar.model + " sees " +
                    (worst.share <= 0 ? "nothing" : percent(worst.share)) +
                    " of the replica's near side" +
                    (forecast.moves ? " " + fixed(when, 1) + " s after its start" : "") + ": " +
                    hindrance(worst, rig, gate);
    finding.step = static_cast<int>(i);
    findings.push_back(finding);
  }
  return findings;
}

}  // namespace berth::procedures
