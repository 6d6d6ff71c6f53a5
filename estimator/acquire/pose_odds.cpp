// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/pose_odds.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace berth::estimator {
namespace {

constexpr double prior_beams = 20;
constexpr double max_through = 0.05;
constexpr int share_steps = 3;
constexpr double min_cosine = 0.1;  // slope beyond which a range says nothing sharper
/// While ranges are widened, the background may not be sharper than they are.
constexpr double annealed_lead = 2;

struct Expected {
  double hit_odds;   // N(z; r, s^2) / b(z); of one that missed 0
  double miss_odds;  // 1 / (1 - p_returns); of one that returned 0
  bool front;
  double residual;
  double variance;
  Vector6d jacobian;  // of the range expected
};

}  // namespace

PoseOdds::At PoseOdds::at(const Pose& pose, double annealing, int thinning) const {
  At result;
  const Pose model_sensor = pose.inverse();
  const Vector3d middle = pose * model_.centre;
  const double distance = middle.norm();
  const double reach = 1.02 * model_.radius;
  const double cone = distance > reach ? std::sqrt(1 - std::pow(reach / distance, 2)) : -1;
  const Vector3d sight = middle / std::max(1e-9, distance);
  static thread_local std::vector<Ray> rays;
  static thread_local std::vector<RayHit> hits;
  static thread_local std::vector<std::size_t> concerned;
  static thread_local std::vector<Expected> met;
  rays.clear();
  concerned.clear();
  met.clear();
  const Matrix3d to_model = model_sensor.rotation.toRotationMatrix();
  const auto& beams = image_.beams();
  for (std::size_t b = 0; b < beams.size(); b += static_cast<std::size_t>(thinning)) {
    if (sight.dot(beams[b].direction) < cone) continue;
    concerned.push_back(b);
    rays.push_back({model_sensor.position, to_model * beams[b].direction});
  }
  hits.resize(rays.size());
  model_.caster.cast(rays, distance + 2 * model_.radius, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!std::isfinite(hits[i].range)) continue;
    const Beam& beam = beams[concerned[i]];
    const double background = image_.log_background()[concerned[i]];
    Expected e{};
    if (!beam.hit()) {
      e.miss_odds = std::exp(-background);
      met.push_back(e);
      continue;
    }
    const Vector3d normal = pose.rotation * hits[i].normal;
    const double cosine = std::max(min_cosine, -normal.dot(beam.direction));
    const double surface = surface_sigma_ / std::max(0.25, cosine);
    e.residual = beam.range - hits[i].range;
    e.variance = beam_model_.range_variance(hits[i].range, std::acos(cosine)) + surface * surface +
                 annealing * annealing;
    const double peak = -0.5 * std::log(6.283185307179586 * e.variance);
    double log_b = background;
    if (annealing > 0) log_b = std::min(log_b, peak - annealed_lead);
    e.hit_odds = std::exp(peak - 0.5 * e.residual * e.residual / e.variance - log_b);
    e.front = e.residual < 0;
    const Vector3d arm = hits[i].range * beam.direction - pose.position;
    e.jacobian.head<3>() = -normal / cosine;
    e.jacobian.tail<3>() = -arm.cross(normal) / cosine;
    met.push_back(e);
  }
  result.expected = static_cast<double>(met.size()) * thinning;
  PoseShares& w = result.shares;
  const PoseShares prior;
  const double weight = prior_beams / thinning;
  for (int step = 0; step <= share_steps; ++step) {
    double hit = prior.hit * weight, front = prior.front * weight, through = prior.through * weight,
           missing = prior.missing * weight;
    result.log_odds = 0;
    for (const Expected& e : met) {
      if (e.miss_odds > 0) {
        result.log_odds += std::log(w.missing * e.miss_odds);
        missing += 1;
        continue;
      }
      const double from_target = w.hit * e.hit_odds;
      const double otherwise = e.front ? w.front : w.through;
      result.log_odds += std::log(from_target + otherwise);
      const double p = from_target / (from_target + otherwise);
      hit += p;
      (e.front ? front : through) += 1 - p;
    }
    if (step == share_steps) break;
    const double all = hit + front + through + missing;
    w = {hit / all, front / all, std::min(max_through, through / all), missing / all};
  }
  for (const Expected& e : met) {
    if (e.miss_odds > 0) continue;
    const double from_target = w.hit * e.hit_odds;
    const double p = from_target / (from_target + (e.front ? w.front : w.through));
    result.gradient += (p * e.residual / e.variance * thinning) * e.jacobian;
    result.information += (p / e.variance * thinning) * e.jacobian * e.jacobian.transpose();
  }
  result.log_odds *= thinning;
  return result;
}

Pose PoseOdds::climbed(const Pose& start, double annealing, int thinning, int rounds) const {
  const Vector3d origin = start * model_.centre - start.position;
  // About the target's centre, lengths in radii.
  Matrix6d about = Matrix6d::Identity();
  about.topRightCorner<3, 3>() = skew(origin);  // position moves where the centre is held
  about.rightCols<3>() /= model_.radius;
  Pose pose = start;
  At here = at(pose, annealing, thinning);
  const double width = std::hypot(annealing, beam_model_.range_sigma_m);
  for (int round = 0; round < rounds; ++round) {
    const double before = here.log_odds;
    Eigen::SelfAdjointEigenSolver<Matrix6d> axes(
        Matrix6d(about.transpose() * here.information * about));
    for (int i = 0; i < 4; ++i) {
      Matrix6d information = about.transpose() * here.information * about;
      information.diagonal().array() += 0.05 / (width * width);
      const Vector6d step =
          about * information.ldlt().solve(Vector6d(about.transpose() * here.gradient));
      const Pose trial = perturbed(pose, step);
      const At there = at(trial, annealing, thinning);
      if (there.log_odds <= here.log_odds) break;
      const bool small = there.log_odds - here.log_odds < 0.1;
      pose = trial;
      here = there;
      if (small) break;
    }
    for (int a = 0; a < 3; ++a) {
      const Vector6d axis = about * axes.eigenvectors().col(a);
      double step = 2 * width;
      int sign = 1;
      for (int tries = 0; tries < 6; ++tries) {
        const Pose trial = perturbed(pose, sign * step * axis);
        const At there = at(trial, annealing, thinning);
        if (there.log_odds > here.log_odds) {
          pose = trial;
          here = there;
          step *= 1.5;
        } else if (sign > 0 && tries == 0) {
          sign = -1;
        } else {
          step *= 0.4;
        }
      }
    }
    if (here.log_odds - before < 0.5) break;
  }
  return pose;
}

Pose laid_on(const TargetModel& model, Pose pose, const std::vector<Vector3d>& points,
             double first_gate, double last_gate, int steps) {
  for (int step = 0; step < steps; ++step) {
    const double gate =
        first_gate * std::pow(last_gate / first_gate, step / std::max(1.0, steps - 1.0));
    const Pose model_sensor = pose.inverse();
    Matrix6d information = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    int used = 0;
    for (const Vector3d& point : points) {
      const Vector3d p = model_sensor * point;
      ClosestPointGrid::Match match;
      if ((p - model.centre).squaredNorm() > std::pow(model.radius + gate, 2) ||
          !model.grid.stored(p, match)) {
        continue;
      }
      const Vector3d off = p - match.point;
      if (off.squaredNorm() > gate * gate) continue;
      const double e = match.normal.dot(off);
      Vector6d j;  // of the surface's way along its normal, about the target's centre
      j << match.normal, (match.point - model.centre).cross(match.normal);
      information += j * j.transpose();
      gradient += e * j;
      ++used;
    }
    if (used < 6) return pose;
    information.diagonal().head<3>().array() += 0.02 * used;
    information.diagonal().tail<3>().array() += 0.02 * used * model.radius * model.radius;
    const Vector6d d = information.ldlt().solve(gradient);
    const Quaterniond turn = rotation_from_vector(d.tail<3>());
    const Vector3d centre = pose * (model.centre + d.head<3>());
    pose.rotation = (pose.rotation * turn).normalized();
    pose.position = centre - pose.rotation * model.centre;
  }
  return pose;
}

}  // namespace berth::estimator
