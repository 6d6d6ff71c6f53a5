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

/// Pieces of the target, cubes with a side of so much of its length, that are elsewhere than
/// modelled, missing or turned, with a probability of their own.
constexpr double piece_of_length = 1.0 / 8;
constexpr int pieces_along = 10;
constexpr double elsewhere = 0.02;

struct Expected {
  int piece;
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
  struct Piece {
    double log_odds = 0;  ///< of its beams, where it is as modelled
    double present = 1;   ///< probability of that
  };
  static thread_local std::vector<Piece> pieces;
  pieces.assign(pieces_along * pieces_along * pieces_along, {});
  const auto piece_at = [&](const Vector3d& place) {
    int index = 0;
    for (int i = 0; i < 3; ++i) {
      // Faces often lie in planes through the centre: those are not to be between two pieces.
      const double along =
          (place[i] - model_.centre[i]) / (piece_of_length * model_.target.length) + 0.3;
      index =
          pieces_along * index +
          std::clamp(static_cast<int>(std::floor(along)) + pieces_along / 2, 0, pieces_along - 1);
    }
    return index;
  };
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
    e.piece = piece_at(rays[i].origin + hits[i].range * rays[i].direction);
    if (!beam.hit()) {
      e.miss_odds = std::exp(-background);
      met.push_back(e);
      continue;
    }
    const Vector3d normal = pose.rotation * hits[i].normal;
    const double cosine = std::max(min_cosine, -normal.dot(beam.direction));
    const double surface = surface_sigma_ / std::max(0.25, cosine);
    e.residual = beam.range - hits[i].range;
    e.variance = image_.noise().range_variance(hits[i].range, std::acos(cosine)) +
                 surface * surface + annealing * annealing;
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
  const auto weigh = [&](const Expected& e) {
    return e.miss_odds > 0 ? w.missing * e.miss_odds
                           : w.hit * e.hit_odds + (e.front ? w.front : w.through);
  };
  for (int step = 0; step <= share_steps; ++step) {
    for (Piece& piece : pieces) piece.log_odds = 0;
    for (const Expected& e : met) {
      pieces[static_cast<std::size_t>(e.piece)].log_odds += thinning * std::log(weigh(e));
    }
    result.log_odds = 0;
    for (Piece& piece : pieces) {
      if (piece.log_odds == 0) continue;
      const double larger = std::max(0.0, piece.log_odds);
      const double here = (1 - elsewhere) * std::exp(piece.log_odds - larger);
      const double either = here + elsewhere * std::exp(-larger);
      piece.present = here / either;
      result.log_odds += larger + std::log(either);
    }
    if (step == share_steps) break;
    double hit = prior.hit * weight, front = prior.front * weight, through = prior.through * weight,
           missing = prior.missing * weight;
    for (const Expected& e : met) {
      const double present = pieces[static_cast<std::size_t>(e.piece)].present;
      if (e.miss_odds > 0) {
        missing += present;
        continue;
      }
      const double p = w.hit * e.hit_odds / weigh(e);
      hit += present * p;
      (e.front ? front : through) += present * (1 - p);
    }
    const double all = hit + front + through + missing;
    w = {hit / all, front / all, std::min(max_through, through / all), missing / all};
  }
  for (const Expected& e : met) {
    if (e.miss_odds > 0) continue;
    const double p = thinning * pieces[static_cast<std::size_t>(e.piece)].present * w.hit *
                     e.hit_odds / weigh(e);
    result.gradient += (p * e.residual / e.variance) * e.jacobian;
    result.information += (p / e.variance) * e.jacobian * e.jacobian.transpose();
  }
  for (const auto& [share, usual] :
       {std::pair{w.hit, prior.hit}, std::pair{w.front, prior.front},
        std::pair{w.through, prior.through}, std::pair{w.missing, prior.missing}}) {
    result.log_odds += prior_beams * usual * std::log(share / usual);
  }
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
  const double width = std::hypot(annealing, image_.noise().range_sigma_m);
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
      const auto higher = [&](double step, double& log_odds) {
        const Pose trial = perturbed(pose, step * axis);
        const At there = at(trial, annealing, thinning);
        log_odds = there.log_odds;
        if (log_odds <= here.log_odds) return false;
        pose = trial;
        here = there;
        return true;
      };
      double step = 2 * width;
      const double middle = here.log_odds;
      double up = 0, down = 0;
      if (!higher(step, up)) {
        if (!higher(-step, down)) {  // the top of the parabola through all three
          higher(0.5 * step * (up - down) / (2 * middle - up - down + 1e-9), up);
          continue;
        }
        step = -step;
      }
      for (int tries = 0; tries < 4 && higher(step *= 1.5, up); ++tries) {
      }
    }
    if (here.log_odds - before < 0.5) break;
  }
  return pose;
}

}  // namespace berth::estimator
