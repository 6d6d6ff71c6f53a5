// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/pose_odds.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace berth::estimator {
namespace {

constexpr double prior_beams = 20;
constexpr double max_through = 0.05;
constexpr double max_missing = 0.5;  // a target found returns half of its beams
constexpr int share_steps = 3;
constexpr double min_cosine = 0.1;           // of incidence: limits the slope of a range
constexpr double min_surface_cosine = 0.25;  // ... the effect of a surface offset
/// Minimum log odds of a fitting beam while a pose is refined with annealing: smooth surfaces,
/// which the background explains as well, attract the pose, too.
constexpr double attraction = 2;

/// Side of a piece over the target's length, and the probability that a piece is not as modelled:
/// missing, or turned.
constexpr double piece_of_length = 1.0 / 8;
constexpr int pieces_along = 10;
constexpr double elsewhere = 0.02;
/// Probability that the face behind an absent piece is as modelled: a missing part is often larger
/// than a piece.
constexpr double beyond_present = 0.5;

constexpr PoseShares usual;

/// A face that a beam should meet, and the fit of its return.
struct Face {
  double range = 0;                    // m
  Vector3d normal = Vector3d::Zero();  // model frame
  double cosine = 1;
  double residual = 0;  // m, of the return
  double variance = 0;  // m^2
  double odds = 0;      // if the piece is as modelled

  /// @param min_odds minimum at zero residual. widened: m^2 of the variance that the peak does not
  /// have
  void expect(double inverse_background, double min_odds, double widened) {
    const double peak = 1 / std::sqrt(2 * std::numbers::pi * (variance - widened));
    odds = std::max(min_odds, peak * inverse_background) *
           std::exp(-0.5 * residual * residual / variance);
  }

  /// Of the range by the pose, as berth::perturbed. direction: of the beam, sensor frame
  Vector6d jacobian(const Pose& pose, const Vector3d& direction) const {
    const Vector3d outward = pose.rotation * normal;
    Vector6d j;
    j.head<3>() = -outward / cosine;
    j.tail<3>() = -(range * direction - pose.position).cross(outward) / cosine;
    return j;
  }
};

/// A beam that should meet the target.
struct Expected {
  std::size_t beam = 0;
  std::size_t piece = 0;
  Face face;
  double miss_odds = 0;  // 1 / (1 - p_returns); of a beam with a return 0
  bool front = false;
  double surface = 0;  // d range / d offset of the surface, inwards
  double inverse_background = 0;
  double odds = 0;  // where the piece is as modelled
};

/// A beam that passed its piece.
struct Through {
  std::size_t met = 0;  // index of the expected beam
  std::size_t beam = 0;
  double range = 0;  // m, to the end of the piece
  Ray on;            // from there
};

/// The face behind the piece of such a beam.
struct Beyond {
  std::size_t met = 0;  // which of those expected
  Face face;
  /// If the piece is absent.
  double odds() const { return 1 - beyond_present + beyond_present * face.odds; }
};

/// The logarithm of a product of many factors, with few logarithms.
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

/// A piece of the target, as the beams of a pose determine it.
struct Piece {
  LogProduct odds;                    // of its beams, if it is as modelled
  LogProduct odds_elsewhere;          // ... if it is absent
  double present = 1;                 // probability that it is as modelled
  double information = 0;             // 1 / m^2, of its offset by its beams
  double offset = 0;                  // m, inwards: the most probable
  double known = 0;                   // as information, with the final responsibilities
  Vector6d slope = Vector6d::Zero();  // derivative of known * offset by the pose
};

/// The pieces that beams meet: cubes about the target's centre.
class Pieces {
 public:
  void reset(const Vector3d& centre, double side) {
    centre_ = centre;
    side_ = side;
    pieces_.clear();
    of_cube_.assign(std::size_t{pieces_along} * pieces_along * pieces_along, -1);
  }
  std::size_t at(const Vector3d& place) {
    std::size_t cube = 0;
    for (int i = 0; i < 3; ++i) {
      const int at = std::clamp(static_cast<int>(std::floor(along(place, i))) + pieces_along / 2, 0,
                                pieces_along - 1);
      cube = pieces_along * cube + static_cast<std::size_t>(at);
    }
    if (of_cube_[cube] < 0) {
      of_cube_[cube] = static_cast<int>(pieces_.size());
      pieces_.emplace_back();
    }
    return static_cast<std::size_t>(of_cube_[cube]);
  }
  /// m, from a point along a direction to the face of its cube.
  double to_end(const Vector3d& place, const Vector3d& direction) const {
    double nearest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; ++i) {
      if (direction[i] == 0) continue;
      const double in = along(place, i) - std::floor(along(place, i));
      nearest = std::min(nearest, side_ * ((direction[i] > 0 ? 1 : 0) - in) / direction[i]);
    }
    return nearest;
  }
  Piece& operator[](std::size_t i) { return pieces_[i]; }
  auto begin() { return pieces_.begin(); }
  auto end() { return pieces_.end(); }

 private:
  /// In sides. Faces often lie in planes through the centre: the grid is shifted so that these do
  /// not lie between two pieces.
  double along(const Vector3d& place, int axis) const {
    return (place[axis] - centre_[axis]) / side_ + 0.3;
  }

  Vector3d centre_ = Vector3d::Zero();
  double side_ = 1;
  std::vector<Piece> pieces_;
  std::vector<int> of_cube_;
};

}  // namespace

double surface_sigma_of(const TargetModel& model, double bare) {
  double largest = 0;
  for (const TargetPart& part : model.target.parts) {
    largest = std::max(largest, model.target.surface_sigma(part, bare));
  }
  return largest;
}

double range_variance(const BeamModel& noise, double surface_sigma, double range, double cosine) {
  // As BeamModel::range_variance, without its trigonometry.
  const double slope = std::max(min_cosine, cosine);
  const double surface = surface_sigma / std::max(min_surface_cosine, cosine);
  return noise.range_sigma_m * noise.range_sigma_m +
         noise.angle_variance() * range * range * (1 / (slope * slope) - 1) + surface * surface;
}

double expected_evidence(const ExpectedRange& truth, const ExpectedRange& other, double depth) {
  constexpr PoseShares w = usual;
  constexpr double elsewhere_share = w.front + w.through;
  const auto met = [](const ExpectedRange& m) { return std::isfinite(m.range); };
  if (!met(truth)) {
    if (!met(other)) return 0;
    return 0.5 * std::log(0.5 / elsewhere_share) + 0.5 * std::log(0.5 / w.missing);
  }
  const auto density = [&](const ExpectedRange& m) {
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

double rival_odds(double lead, std::span<const double> best, std::span<const double> other,
                  double threshold, double required) {
  double scatter = 0;
  double alone = -threshold;
  for (std::size_t b = 0; b < best.size(); ++b) {
    scatter += std::pow(best[b] - other[b], 2);
    if (best[b] == 0) alone += other[b];
  }
  const double p_by_scatter = scatter > 0 ? 0.5 * std::erfc(lead / std::sqrt(2 * scatter)) : 0;
  return std::max(std::exp(-lead / std::max(1.0, alone / required)),
                  p_by_scatter / (1 - p_by_scatter));
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

/// The odds of the beams that a pose concerns.
class PoseOdds::Evaluation {
 public:
  /// @param surface_sigma m, of the pieces' offsets; 0: none
  void begin(const TargetModel& model, double surface_sigma, double annealing, int thinning,
             bool refining) {
    pieces_.reset(model.centre, piece_of_length * model.target.length);
    met_.clear();
    beyond_.clear();
    sigma_ = surface_sigma;
    min_odds_ = annealing > 0 ? std::exp(refining ? attraction : 0) : 0;
    widened_ = refining ? 0 : annealing * annealing;
    thinning_ = thinning;
  }

  void miss(std::size_t beam, const Ray& ray, const RayHit& hit, double inverse_background) {
    Expected& e = met_.emplace_back();
    e.beam = beam;
    e.piece = pieces_.at(ray.origin + hit.range * ray.direction);
    e.miss_odds = inverse_background;
  }

  /// @param variance m^2, of the range, surface included
  /// @return for a beam that more probably passed the face than returned from it
  std::optional<Through> hit(std::size_t beam, const Beam& measured, const Ray& ray,
                             const RayHit& hit, double cosine, double variance,
                             double inverse_background) {
    const Vector3d place = ray.origin + hit.range * ray.direction;
    Expected& e = met_.emplace_back();
    e.beam = beam;
    e.piece = pieces_.at(place);
    e.surface = 1 / std::max(min_surface_cosine, cosine);
    e.inverse_background = inverse_background;
    e.face = faced(measured, hit.range, hit, cosine, variance, inverse_background);
    e.front = e.face.residual < 0;
    const double fits = usual.hit * e.face.odds;
    const double otherwise = e.front ? usual.front : usual.through;
    if (has_surface_offset()) {
      const double p = fits / (fits + otherwise);
      e.face.variance -= std::pow(e.surface * sigma_, 2);
      const double information = thinning_ * p * e.surface / e.face.variance;
      pieces_[e.piece].information += information * e.surface;
      pieces_[e.piece].offset += information * e.face.residual;
    }
    if (e.front || fits >= otherwise) return std::nullopt;
    const double on = pieces_.to_end(place, ray.direction);
    return Through{
        met_.size() - 1, beam, hit.range + on, {place + on * ray.direction, ray.direction}};
  }

  /// Adds the face that such a beam meets behind its piece.
  void beyond(std::size_t met, const Beam& measured, double range, const RayHit& hit, double cosine,
              double variance) {
    const Expected& e = met_[met];
    beyond_.push_back({met, faced(measured, range, hit, cosine, variance, e.inverse_background)});
    pieces_[e.piece].odds_elsewhere.multiply(beyond_.back().odds());
  }

  /// Number of beams that should meet the target.
  double expected() const { return static_cast<double>(met_.size()) * thinning_; }

  /// The share of them on pieces that are as modelled.
  double present() {
    double sum = 0;
    for (const Expected& e : met_) sum += pieces_[e.piece].present;
    return met_.empty() ? 0 : sum / static_cast<double>(met_.size());
  }

  /// Sets every piece's most probable offset and removes the surface's variance from its ranges.
  void apply_offsets() {
    if (!has_surface_offset()) return;
    for (Piece& piece : pieces_) piece.offset /= piece.information + 1 / (sigma_ * sigma_);
    for (Expected& e : met_) {
      if (e.miss_odds > 0) continue;
      e.face.residual -= e.surface * pieces_[e.piece].offset;
      e.front = e.face.residual < 0;
      e.face.expect(e.inverse_background, min_odds_, widened_);
    }
  }

  /// Log odds; also sets each piece's probability of being as modelled.
  double weigh(const PoseShares& w) {
    for (Piece& piece : pieces_) piece.odds = {};
    for (Expected& e : met_) {
      e.odds = e.miss_odds > 0 ? w.missing * e.miss_odds
                               : w.hit * e.face.odds + (e.front ? w.front : w.through);
      pieces_[e.piece].odds.multiply(e.odds);
    }
    double sum = 0;
    for (Piece& piece : pieces_) {
      double log_odds = thinning_ * piece.odds.log();
      if (has_surface_offset()) {
        log_odds -= 0.5 * std::pow(piece.offset / sigma_, 2) +
                    0.5 * std::log1p(piece.information * sigma_ * sigma_);
      }
      const double log_elsewhere = thinning_ * piece.odds_elsewhere.log();
      const double larger = std::max(log_elsewhere, log_odds);
      const double here = (1 - elsewhere) * std::exp(log_odds - larger);
      const double either = here + elsewhere * std::exp(log_elsewhere - larger);
      piece.present = here / either;
      sum += larger + std::log(either);
    }
    return sum;
  }

  /// The next shares of expectation maximisation.
  PoseShares shares(const PoseShares& w) {
    const double weight = prior_beams / thinning_;
    double hit = usual.hit * weight, front = usual.front * weight, through = usual.through * weight,
           missing = usual.missing * weight;
    for (const Expected& e : met_) {
      const double present = pieces_[e.piece].present;
      if (e.miss_odds > 0) {
        missing += present;
        continue;
      }
      const double p = w.hit * e.face.odds / e.odds;
      hit += present * p;
      (e.front ? front : through) += present * (1 - p);
    }
    const double all = hit + front + through + missing;
    return {hit / all, front / all, std::min(max_through, through / all),
            std::min(max_missing, missing / all)};
  }

  /// Contribution of each beam.
  void contributions(std::span<double> of_beams) {
    if (of_beams.empty()) return;
    for (const Expected& e : met_) {
      of_beams[e.beam] = thinning_ * pieces_[e.piece].present * std::log(e.odds);
    }
    for (const Beyond& b : beyond_) {
      const Expected& e = met_[b.met];
      of_beams[e.beam] += thinning_ * (1 - pieces_[e.piece].present) * std::log(b.odds());
    }
  }

  /// Gradient and information of ranges by the pose.
  void differentiate(const Pose& pose, const std::vector<Beam>& beams, At& at) {
    // A range that returned from a face with probability p.
    const auto add = [&](const Face& face, double p, const Vector6d& jacobian) {
      at.gradient += (p * face.residual) * jacobian;
      for (int k = 0; k < 6; ++k) at.information.col(k) += (p * jacobian[k]) * jacobian;
    };
    for (const Beyond& b : beyond_) {
      if (b.face.odds < 1e-6) continue;
      const Expected& e = met_[b.met];
      const double p = thinning_ * (1 - pieces_[e.piece].present) * beyond_present * b.face.odds /
                       b.odds() / b.face.variance;
      add(b.face, p, b.face.jacobian(pose, beams[e.beam].direction));
    }
    for (const Expected& e : met_) {
      if (e.face.odds < 1e-6 * e.odds) continue;
      const double p = thinning_ * pieces_[e.piece].present * at.shares.hit * e.face.odds / e.odds /
                       e.face.variance;
      const Vector6d jacobian = e.face.jacobian(pose, beams[e.beam].direction);
      add(e.face, p, jacobian);
      if (!has_surface_offset()) continue;
      pieces_[e.piece].slope += (p * e.surface) * jacobian;
      pieces_[e.piece].known += p * e.surface * e.surface;
    }
    if (!has_surface_offset()) return;
    for (const Piece& piece : pieces_) {
      at.information -=
          piece.slope * piece.slope.transpose() / (piece.known + 1 / (sigma_ * sigma_));
    }
  }

 private:
  bool has_surface_offset() const { return sigma_ > 0; }
  Face faced(const Beam& measured, double range, const RayHit& hit, double cosine, double variance,
             double inverse_background) const {
    Face face{range, hit.normal, cosine, measured.range - range, variance, 0};
    face.expect(inverse_background, min_odds_, widened_);
    return face;
  }

  Pieces pieces_;
  std::vector<Expected> met_;
  std::vector<Beyond> beyond_;
  double sigma_ = 0;
  double min_odds_ = 0;
  double widened_ = 0;
  int thinning_ = 1;
};

void PoseOdds::meet(const Pose& pose, double annealing, int thinning,
                    Evaluation& evaluation) const {
  static thread_local std::vector<RangeImage::Span> spans;
  static thread_local std::vector<Ray> rays;
  static thread_local std::vector<RayHit> hits;
  static thread_local std::vector<std::size_t> concerned;
  static thread_local std::vector<Through> through;
  rays.clear();
  concerned.clear();
  through.clear();
  const Pose model_sensor = pose.inverse();
  const Matrix3d to_model = model_sensor.rotation.toRotationMatrix();
  const double distance = (pose * model_.centre).norm();
  const double nearest = distance - model_.radius;  // returns before it are occluders
  const auto& beams = image_.beams();
  image_.spans_of(model_.caster.bounds(), pose, spans);
  const auto every = static_cast<std::size_t>(thinning);
  for (const RangeImage::Span& span : spans) {
    for (std::size_t b = (span.from + every - 1) / every * every; b < span.to; b += every) {
      concerned.push_back(b);
      rays.push_back({model_sensor.position, to_model * beams[b].direction});
    }
  }
  // Cosine of incidence, and variance (m^2) of the range.
  const auto slope = [&](double range, const RayHit& hit, const Ray& ray) {
    const double cosine = std::max(min_cosine, -hit.normal.dot(ray.direction));
    return std::pair(cosine, range_variance(image_.noise(), surface_sigma_, range, cosine) +
                                 annealing * annealing);
  };
  hits.resize(rays.size());
  model_.caster.cast(rays, distance + 2 * model_.radius, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const std::size_t b = concerned[i];
    if (!std::isfinite(hits[i].range) || beams[b].range < nearest || left_out_[b] != 0) continue;
    if (!beams[b].hit()) {
      const double otherwise = image_.nearest_about(image_.pixel_of(static_cast<int>(b)));
      if (otherwise < nearest) continue;
      evaluation.miss(b, rays[i], hits[i], inverse_background_[b]);
      continue;
    }
    const auto [cosine, variance] = slope(hits[i].range, hits[i], rays[i]);
    const auto passed =
        evaluation.hit(b, beams[b], rays[i], hits[i], cosine, variance, inverse_background_[b]);
    if (passed && annealing == 0) through.push_back(*passed);
  }
  rays.clear();
  for (const Through& t : through) rays.push_back(t.on);
  hits.resize(rays.size());
  model_.caster.cast(rays, 2 * model_.radius, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!std::isfinite(hits[i].range)) continue;
    const double range = through[i].range + hits[i].range;
    const auto [cosine, variance] = slope(range, hits[i], rays[i]);
    evaluation.beyond(through[i].met, beams[through[i].beam], range, hits[i], cosine, variance);
  }
}

PoseOdds::At PoseOdds::at(const Pose& pose, double annealing, int thinning,
                          std::span<double> of_beams) const {
  return evaluated(pose, annealing, thinning, false, of_beams);
}

double PoseOdds::log_odds(const Pose& pose, double annealing, int thinning) const {
  return weigh(pose, annealing, thinning, false).first.log_odds;
}

PoseOdds::At PoseOdds::evaluated(const Pose& pose, double annealing, int thinning, bool refining,
                                 std::span<double> of_beams) const {
  auto [result, evaluation] = weigh(pose, annealing, thinning, refining);
  evaluation.contributions(of_beams);
  evaluation.differentiate(pose, image_.beams(), result);
  return result;
}

std::pair<PoseOdds::At, PoseOdds::Evaluation&> PoseOdds::weigh(const Pose& pose, double annealing,
                                                               int thinning, bool refining) const {
  static thread_local Evaluation evaluation;  // reuses its memory
  evaluation.begin(model_, annealing == 0 ? surface_sigma_ : 0, annealing, thinning, refining);
  meet(pose, annealing, thinning, evaluation);
  evaluation.apply_offsets();
  At result;
  result.expected = evaluation.expected();
  result.log_odds = evaluation.weigh(result.shares);
  for (int step = 0; step < share_steps; ++step) {
    result.shares = evaluation.shares(result.shares);
    result.log_odds = evaluation.weigh(result.shares);
  }
  const PoseShares& w = result.shares;
  for (const auto& [share, as_usual] :
       {std::pair{w.hit, usual.hit}, std::pair{w.front, usual.front},
        std::pair{w.through, usual.through}, std::pair{w.missing, usual.missing}}) {
    result.log_odds += prior_beams * as_usual * std::log(share / as_usual);
  }
  result.present = evaluation.present();
  return {result, evaluation};
}

PoseOdds::Refined PoseOdds::refined(const Pose& start, double annealing, int thinning,
                                    int rounds) const {
  const Vector3d origin = start * model_.centre - start.position;
  // Perturbations about the target's centre, rotations in radii.
  Matrix6d about = Matrix6d::Identity();
  about.topRightCorner<3, 3>() = skew(origin);  // a rotation about the centre moves the origin
  about.rightCols<3>() /= model_.radius;
  const auto odds = [&](const Pose& p) { return evaluated(p, annealing, thinning, true, {}); };
  Pose pose = start;
  At here = odds(pose);
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
      const At there = odds(trial);
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
        const At there = odds(trial);
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
        if (!higher(-step, down)) {  // maximum of the parabola through the three
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
  return {pose, annealing > 0 ? at(pose, annealing, thinning) : here};
}

}  // namespace berth::estimator
