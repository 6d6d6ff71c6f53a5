// SPDX-License-Identifier: BSD-3-Clause
#include "test/benchmarks/judge_likelihood.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "test/benchmarks/cramer_rao.h"

namespace berth::benchmark {
namespace {

/// What cannot be, as a probability of a miss and as a density (1/m) of a range.
constexpr double impossible = 1e-4;
constexpr double decisive = 5;

double log_normal_density(double error, double variance) {
  return -0.5 * (error * error / variance + std::log(2 * std::numbers::pi * variance));
}

struct Offset {
  double azimuth;  // in sigmas
  double elevation;
  double weight;
};

/// A two-dimensional normal distribution on three rings.
const std::vector<Offset>& offsets() {
  static const std::vector<Offset> all = [] {
    std::vector<Offset> made;
    const std::array<std::pair<double, double>, 3> rings = {
        {{0.5, 0.39}, {1.5, 0.47}, {2.5, 0.14}}};
    for (const auto& [radius, mass] : rings) {
      for (int i = 0; i < 6; ++i) {
        const double at = std::numbers::pi * (i + radius) / 3;
        made.push_back({radius * std::cos(at), radius * std::sin(at), mass / 6});
      }
    }
    return made;
  }();
  return all;
}

}  // namespace

double JudgeLikelihood::of_beam(const RawBeam& beam, const Pose& to_model) const {
  const bool returned = beam.status == BeamStatus::hit;
  RayHit hit;
  double facing = 0;
  const auto meets = [&](double azimuth, double elevation) {
    const Vector3d ray = to_model.rotation * beam_direction(azimuth, elevation);
    if (!caster_.cast({to_model.position, ray}, noise_.range_max_m, hit)) return false;
    facing = -hit.normal.dot(ray);
    return true;
  };
  // Of the range, when angle errors of so many sigmas act on the surface's slope.
  const auto variance = [&](double angle_sigmas) {
    const double cosine = std::max(0.01, facing);
    const double slope = hit.range * std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine;
    return std::pow(noise_.range_sigma_m, 2) +
           std::pow(angle_sigmas * slope * noise_.azimuth_sigma_rad, 2);
  };
  const bool met = meets(beam.azimuth, beam.elevation);
  if (!returned && !met) return 0;
  constexpr double min_facing = 0.15;  // flatter, a slope is no good picture of a surface
  if (returned && met && facing > min_facing) {
    const double error = beam.range - hit.range;
    if (error * error < 16 * variance(1)) return log_normal_density(error, variance(1));
  }
  // The beam may have passed an edge: sum over where it may have gone.
  double probability = impossible;
  for (const Offset& o : offsets()) {
    const bool meets_here = meets(beam.azimuth + o.azimuth * noise_.azimuth_sigma_rad,
                                  beam.elevation + o.elevation * noise_.elevation_sigma_rad);
    if (returned && meets_here) {
      probability += o.weight * std::exp(log_normal_density(beam.range - hit.range, variance(0.4)));
    } else if (!returned && !meets_here) {
      probability += o.weight;
    }
  }
  return std::log(probability);
}

double JudgeLikelihood::of(const std::vector<RawBeam>& beams, const Pose& pose,
                           double pruned) const {
  const Pose to_model = pose.inverse();
  // What beams can still add at best.
  const double best = std::max(0.0, log_normal_density(0, std::pow(noise_.range_sigma_m, 2)));
  double left = 0;
  for (const RawBeam& b : beams) left += b.status == BeamStatus::hit ? best : 0;
  double sum = 0;
  for (const RawBeam& beam : beams) {
    sum += of_beam(beam, to_model);
    if (beam.status == BeamStatus::hit) left -= best;
    if (sum + left < pruned) return pruned;
  }
  return sum;
}

Pose JudgeLikelihood::polished(const std::vector<RawBeam>& beams, Pose pose) const {
  for (const double gate : {0.3, 0.1, 0.05, 0.05, 0.05}) {
    const Pose to_model = pose.inverse();
    Matrix6d information = Matrix6d::Identity();
    Vector6d gradient = Vector6d::Zero();
    for (const RawBeam& beam : beams) {
      if (beam.status != BeamStatus::hit) continue;
      const Vector3d direction = beam_direction(beam.azimuth, beam.elevation);
      RayHit hit;
      if (!caster_.cast({to_model.position, to_model.rotation * direction}, noise_.range_max_m,
                        hit)) {
        continue;
      }
      const double error = beam.range - hit.range;
      const Vector3d normal = pose.rotation * hit.normal;
      const double facing = normal.dot(direction);
      if (std::abs(error) > gate || facing > -0.05) continue;
      Vector6d jacobian;
      jacobian << normal, (hit.range * direction - pose.position).cross(normal);
      jacobian /= facing;
      const double weight = 1 / std::pow(noise_.range_sigma_m, 2);
      information += weight * jacobian * jacobian.transpose();
      gradient += weight * error * jacobian;
    }
    pose = perturbed(pose, information.ldlt().solve(gradient));
  }
  return pose;
}

double JudgeLikelihood::lead(const std::vector<RawBeam>& beams, const Pose& truth,
                             const PoseJudge& judge, const std::vector<Pose>& hypotheses,
                             Random random) const {
  const double of_truth = of(beams, truth);
  const double pruned = of_truth - 200;
  std::vector<Pose> starts = judge.rivals(truth);
  starts.insert(starts.end(), hypotheses.begin(), hypotheses.end());
  struct Rival {
    double value;
    Pose pose;
  };
  std::vector<Rival> rivals;
  for (const Pose& start : starts) {
    const Pose polished_pose = polished(beams, start);
    for (const Pose& pose : {start, polished_pose}) {
      if (judge.right(truth, pose)) continue;
      rivals.push_back({of(beams, pose, pruned), pose});
    }
  }
  std::stable_sort(rivals.begin(), rivals.end(),
                   [](const Rival& a, const Rival& b) { return a.value > b.value; });
  rivals.resize(std::min<std::size_t>(rivals.size(), 3));
  double best = pruned;
  for (Rival& rival : rivals) {
    if (rival.value <= pruned) continue;
    for (int i = 0; i < 60 && rival.value < of_truth - decisive; ++i) {
      const double size = 0.005 * std::pow(0.93, i);
      Vector6d step;
      step << random.normal_vector(size), random.normal_vector(size);
      const Pose pose = perturbed(rival.pose, step);
      if (judge.right(truth, pose)) continue;
      const double value = of(beams, pose, rival.value);
      if (value > rival.value) rival = {value, pose};
    }
    best = std::max(best, rival.value);
  }
  return of_truth - best;
}

}  // namespace berth::benchmark
