// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/pose_odds.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace berth::estimator {
namespace {

constexpr double prior_beams = 20;
constexpr double max_through = 0.05;
constexpr double max_missing = 0.5;  // of a target that is found, half returns
constexpr int share_steps = 3;
constexpr double min_cosine = 0.1;           // slope beyond which a range says nothing sharper
constexpr double min_surface_cosine = 0.25;  // ... beyond which the surface is off by no more
/// While ranges are widened, the background may not be sharper than they are.
constexpr double annealed_lead = 2;

/// Pieces of the target, cubes with a side of so much of its length, that are elsewhere than
/// modelled, missing or turned, with a probability of their own.
constexpr double piece_of_length = 1.0 / 8;
constexpr int pieces_along = 10;
constexpr double elsewhere = 0.02;

struct Expected {
  std::size_t ray = 0;
  std::size_t piece = 0;
  double hit_odds = 0;   // N(z; r, s^2) / b(z); of one that missed 0
  double miss_odds = 0;  // 1 / (1 - p_returns); of one that returned 0
  bool front = false;
  double cosine = 0;
  double surface = 0;  // range is so much longer where the surface is farther in by 1
  double residual = 0;
  double variance = 0;
  double inverse_background = 0;
  double odds = 0;  // of the beam, where the piece is as modelled

  void expect(double blunt) {
    const double peak = 1 / std::sqrt(2 * std::numbers::pi * variance);
    hit_odds = std::max(blunt, peak * inverse_background) *
               std::exp(-0.5 * residual * residual / variance);
    front = residual < 0;
  }
};

/// The logarithm of a product of many, and few logarithms.
class LogProduct {
 public:
  void multiply(double factor) {
    product_ *= factor;
    if (product_ > 1e100 || product_ < 1e-100) *this = LogProduct(log(), 1);
  }
  double log() const { return log_ + std::log(product_); }
  LogProduct() = default;

 private:
  LogProduct(double log, double product) : log_(log), product_(product) {}
  double log_ = 0;
  double product_ = 1;
};

/// A piece of the target, as a pose's beams have it.
struct Piece {
  LogProduct odds;                    // of its beams, where it is as modelled
  double present = 1;                 // probability of that
  double information = 0;             // 1 / m^2, of its offset: of its beams
  double offset = 0;                  // m, inwards: of its surface, most probable
  double known = 0;                   // as information, of beams as they turned out
  Vector6d slope = Vector6d::Zero();  // of known times offset, by the pose
};

/// The pieces that beams meet: cubes about the target's centre.
class Pieces {
 public:
  void lay(const Vector3d& centre, double side) {
    centre_ = centre;
    side_ = side;
    pieces_.clear();
    of_cube_.assign(pieces_along * pieces_along * pieces_along, -1);
  }
  std::size_t at(const Vector3d& place) {
    std::size_t cube = 0;
    for (int i = 0; i < 3; ++i) {
      // Faces often lie in planes through the centre: those are not to be between two pieces.
      const double along = (place[i] - centre_[i]) / side_ + 0.3;
      const int at =
          std::clamp(static_cast<int>(std::floor(along)) + pieces_along / 2, 0, pieces_along - 1);
      cube = pieces_along * cube + static_cast<std::size_t>(at);
    }
    if (of_cube_[cube] < 0) {
      of_cube_[cube] = static_cast<int>(pieces_.size());
      pieces_.emplace_back();
    }
    return static_cast<std::size_t>(of_cube_[cube]);
  }
  Piece& operator[](std::size_t i) { return pieces_[i]; }
  auto begin() { return pieces_.begin(); }
  auto end() { return pieces_.end(); }

 private:
  Vector3d centre_ = Vector3d::Zero();
  double side_ = 1;
  std::vector<Piece> pieces_;
  std::vector<int> of_cube_;
};

}  // namespace

double surface_sigma_of(const TargetModel& model, double bare) {
  if (model.target.description_hash.empty()) return bare;
  double largest = 0;
  for (const TargetPart& part : model.target.parts) largest = std::max(largest, part.surface_sigma);
  return largest;
}

double range_variance(const BeamModel& noise, double surface_sigma, double range, double cosine) {
  // As BeamModel::range_variance, without its trigonometry.
  const double slope = std::max(min_cosine, cosine);
  const double surface = surface_sigma / std::max(min_surface_cosine, cosine);
  return noise.range_sigma_m * noise.range_sigma_m +
         noise.angle_variance() * range * range * (1 / (slope * slope) - 1) + surface * surface;
}

double expected_evidence(const BeamMeets& truth, const BeamMeets& other, double depth) {
  constexpr PoseShares w;
  constexpr double elsewhere_share = w.front + w.through;
  const auto met = [](const BeamMeets& m) { return std::isfinite(m.range); };
  if (!met(truth)) {
    if (!met(other)) return 0;
    return 0.5 * std::log(0.5 / elsewhere_share) + 0.5 * std::log(0.5 / w.missing);
  }
  const auto density = [&](const BeamMeets& m) {
    if (!met(m)) return 0.5 / depth;
    const double off = truth.range - m.range;
    return w.hit * std::exp(-0.5 * off * off / m.variance) /
               std::sqrt(2 * std::numbers::pi * m.variance) +
           elsewhere_share / depth;
  };
  double evidence = w.hit * std::log(density(truth) / density(other));
  if (!met(other)) {
    evidence +=
        elsewhere_share * std::log(elsewhere_share / 0.5) + w.missing * std::log(w.missing / 0.5);
  }
  return evidence;
}

double rival_odds(double lead, std::span<const double> best, std::span<const double> other) {
  double scatter = 0;
  for (std::size_t b = 0; b < best.size(); ++b) scatter += std::pow(best[b] - other[b], 2);
  const double by_chance = scatter > 0 ? 0.5 * std::erfc(lead / std::sqrt(2 * scatter)) : 0;
  return std::max(std::exp(-lead), by_chance / (1 - by_chance));
}

PoseOdds::PoseOdds(const TargetModel& model, const RangeImage& image, double surface_sigma)
    : model_(model), image_(image), surface_sigma_(surface_sigma) {
  for (const double log_b : image.log_background()) {
    inverse_background_.push_back(std::exp(-log_b));
  }
  left_out_.assign(inverse_background_.size(), 0);
}

PoseOdds PoseOdds::without(const std::vector<char>& left_out) const {
  PoseOdds odds = *this;
  odds.left_out_ = left_out;
  return odds;
}

PoseOdds PoseOdds::with_background(const std::vector<double>& log_background) const {
  PoseOdds odds = *this;
  for (std::size_t b = 0; b < log_background.size(); ++b) {
    odds.inverse_background_[b] = std::exp(-log_background[b]);
  }
  return odds;
}

PoseOdds::At PoseOdds::at(const Pose& pose, double annealing, int thinning,
                          std::span<double> of_beams) const {
  At result;
  const Pose model_sensor = pose.inverse();
  const double distance = (pose * model_.centre).norm();
  const double nearest = distance - model_.radius;  // what is before that hides the target
  static thread_local std::vector<RangeImage::Span> spans;
  static thread_local std::vector<Ray> rays;
  static thread_local std::vector<RayHit> hits;
  static thread_local std::vector<std::size_t> concerned;
  static thread_local std::vector<Expected> met;
  rays.clear();
  concerned.clear();
  met.clear();
  static thread_local Pieces pieces;
  pieces.lay(model_.centre, piece_of_length * model_.target.length);
  const Matrix3d to_model = model_sensor.rotation.toRotationMatrix();
  const auto& beams = image_.beams();
  image_.spans_of(model_.caster.bounds(), pose, spans);
  const auto every = static_cast<std::size_t>(thinning);
  for (const RangeImage::Span& span : spans) {
    for (std::size_t b = (span.from + every - 1) / every * every; b < span.to; b += every) {
      concerned.push_back(b);
      rays.push_back({model_sensor.position, to_model * beams[b].direction});
    }
  }
  hits.resize(rays.size());
  model_.caster.cast(rays, distance + 2 * model_.radius, hits);
  const double blunt = annealing > 0 ? std::exp(annealed_lead) : 0;
  const bool off_together = annealing == 0 && surface_sigma_ > 0;
  const PoseShares prior;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!std::isfinite(hits[i].range)) continue;
    const Beam& beam = beams[concerned[i]];
    if (beam.range < nearest || left_out_[concerned[i]] != 0) continue;
    const double range = hits[i].range;
    Expected& e = met.emplace_back();
    e.ray = i;
    e.piece = pieces.at(rays[i].origin + range * rays[i].direction);
    if (!beam.hit()) {
      e.miss_odds = inverse_background_[concerned[i]];
      continue;
    }
    e.cosine = std::max(min_cosine, -hits[i].normal.dot(rays[i].direction));
    e.surface = 1 / std::max(min_surface_cosine, e.cosine);
    e.residual = beam.range - range;
    e.variance =
        range_variance(image_.noise(), surface_sigma_, range, e.cosine) + annealing * annealing;
    e.inverse_background = inverse_background_[concerned[i]];
    e.expect(blunt);
    if (!off_together) continue;
    const double hit = prior.hit * e.hit_odds;
    const double p = hit / (hit + (e.front ? prior.front : prior.through));
    e.variance -= std::pow(e.surface * surface_sigma_, 2);
    const double information = thinning * p * e.surface / e.variance;
    pieces[e.piece].information += information * e.surface;
    pieces[e.piece].offset += information * e.residual;
  }
  result.expected = static_cast<double>(met.size()) * thinning;
  PoseShares& w = result.shares;
  const double weight = prior_beams / thinning;
  if (off_together) {
    for (Piece& piece : pieces) piece.offset /= piece.information + std::pow(surface_sigma_, -2);
    for (Expected& e : met) {
      if (e.miss_odds > 0) continue;
      e.residual -= e.surface * pieces[e.piece].offset;
      e.expect(blunt);
    }
  }
  for (int step = 0; step <= share_steps; ++step) {
    for (Piece& piece : pieces) piece.odds = {};
    for (Expected& e : met) {
      e.odds = e.miss_odds > 0 ? w.missing * e.miss_odds
                               : w.hit * e.hit_odds + (e.front ? w.front : w.through);
      pieces[e.piece].odds.multiply(e.odds);
    }
    result.log_odds = 0;
    for (Piece& piece : pieces) {
      double log_odds = thinning * piece.odds.log();
      if (off_together) {
        log_odds -= 0.5 * std::pow(piece.offset / surface_sigma_, 2) +
                    0.5 * std::log1p(piece.information * surface_sigma_ * surface_sigma_);
      }
      const double larger = std::max(0.0, log_odds);
      const double here = (1 - elsewhere) * std::exp(log_odds - larger);
      const double either = here + elsewhere * std::exp(-larger);
      piece.present = here / either;
      result.log_odds += larger + std::log(either);
    }
    if (step == share_steps) break;
    double hit = prior.hit * weight, front = prior.front * weight, through = prior.through * weight,
           missing = prior.missing * weight;
    for (const Expected& e : met) {
      const double present = pieces[e.piece].present;
      if (e.miss_odds > 0) {
        missing += present;
        continue;
      }
      const double p = w.hit * e.hit_odds / e.odds;
      hit += present * p;
      (e.front ? front : through) += present * (1 - p);
    }
    const double all = hit + front + through + missing;
    w = {hit / all, front / all, std::min(max_through, through / all),
         std::min(max_missing, missing / all)};
  }
  for (const Expected& e : met) {
    if (of_beams.empty()) break;
    of_beams[concerned[e.ray]] = thinning * pieces[e.piece].present * std::log(e.odds);
  }
  for (const Expected& e : met) {
    if (e.hit_odds < 1e-6 * e.odds) continue;
    const double p = thinning * pieces[e.piece].present * w.hit * e.hit_odds / e.odds / e.variance;
    const Vector3d normal = pose.rotation * hits[e.ray].normal;
    const Vector3d arm = hits[e.ray].range * beams[concerned[e.ray]].direction - pose.position;
    Vector6d jacobian;  // of the range expected
    jacobian.head<3>() = -normal / e.cosine;
    jacobian.tail<3>() = -arm.cross(normal) / e.cosine;
    result.gradient += (p * e.residual) * jacobian;
    for (int k = 0; k < 6; ++k) result.information.col(k) += (p * jacobian[k]) * jacobian;
    if (!off_together) continue;
    pieces[e.piece].slope += (p * e.surface) * jacobian;
    pieces[e.piece].known += p * e.surface * e.surface;
  }
  if (off_together) {
    for (const Piece& piece : pieces) {
      result.information -=
          piece.slope * piece.slope.transpose() / (piece.known + std::pow(surface_sigma_, -2));
    }
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
  for (int round = 0; round < std::max(1, rounds); ++round) {
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
    for (int a = 0; a < (rounds > 0 ? 3 : 0); ++a) {
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
