// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/hypothesis_acquisition.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "common/core/text.h"
#include "estimator/acquire/large_planes.h"
#include "estimator/model/point_fit.h"

namespace berth::estimator {
namespace {

// Choices of cost.
constexpr int coarse_beams = 300;  // in the target's sphere, of which poses are first weighed
constexpr int middle_beams = 800;
constexpr int final_beams = 4000;
constexpr std::size_t laid_points = 200;
/// Of what is searched, and of the beams that should meet the target, what a pose explains that
/// needs no wider search.
constexpr double explains_enough = 0.9;
/// Of the best pose's log odds, with ranges widened: one so much below it is no rival.
constexpr double no_rival = 0.5;

/// Planes wider than this, in radii of the target's sphere, cannot be the target's.
constexpr double too_wide = 2.15;
constexpr double log_two_pi = 1.8378770664093453;

double surface_sigma_of(const TargetModel& model, double bare) {
  if (model.target.description_hash.empty()) return bare;
  double largest = 0;
  for (const TargetPart& part : model.target.parts) largest = std::max(largest, part.surface_sigma);
  return largest;
}

/// The first of every cube with that side.
std::vector<Vector3d> one_a_cube(const std::vector<Vector3d>& points, double side) {
  std::set<std::array<int, 3>> taken;
  std::vector<Vector3d> kept;
  for (const Vector3d& p : points) {
    const auto at = [&](int axis) { return static_cast<int>(std::floor(p[axis] / side)); };
    if (taken.insert({at(0), at(1), at(2)}).second) kept.push_back(p);
  }
  return kept;
}

std::vector<Vector3d> evenly(const std::vector<Vector3d>& points, std::size_t max) {
  if (points.size() <= max) return points;
  std::vector<Vector3d> some;
  for (std::size_t i = 0; i < max; ++i) some.push_back(points[i * points.size() / max]);
  return some;
}

/// Every so many-th beam, so that about so many are in a sphere of that radius at the range of the
/// returns.
int thinning_for(const RangeImage& image, double radius, int beams) {
  const double middle = 0.5 * (image.nearest() + image.farthest());
  const double inside = std::min(static_cast<double>(image.beams().size()),
                                 3.14159 * std::pow(radius / (middle * image.spacing()), 2));
  return std::max(1, static_cast<int>(inside / beams));
}

/// Returns that may be the target's.
std::vector<Vector3d> searched(const RangeImage& image, double radius) {
  const std::vector<char> left_out =
      on_large_planes(image, too_wide * radius, image.noise().range_sigma_m);
  std::vector<Vector3d> points;
  for (std::size_t b = 0; b < left_out.size(); ++b) {
    const Beam& beam = image.beams()[b];
    if (left_out[b] == 0 && beam.hit() && beam.range >= image.nearest() &&
        beam.range <= image.farthest()) {
      points.push_back(beam.point());
    }
  }
  return points;
}

/// Those nearest to the middle of all.
std::vector<Vector3d> middle_of(std::vector<Vector3d> points, std::size_t count) {
  Vector3d mean = Vector3d::Zero();
  for (const Vector3d& p : points) mean += p / static_cast<double>(points.size());
  count = std::min(count, points.size());
  std::partial_sort(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(count),
                    points.end(), [&](const Vector3d& a, const Vector3d& b) {
                      return (a - mean).squaredNorm() < (b - mean).squaredNorm();
                    });
  points.resize(count);
  return points;
}

}  // namespace

HypothesisAcquisition::HypothesisAcquisition(const TargetModel& model, const BeamModel& beam_model,
                                             const HypothesisAcquisitionOptions& options)
    : model_(model),
      beam_model_(beam_model),
      options_(options),
      surface_sigma_(surface_sigma_of(model, options.bare_surface_sigma_m)),
      templates_(make_view_templates(model.caster, model.centre, model.radius, options.views)) {}

bool HypothesisAcquisition::same(const Pose& a, const Pose& b) const {
  return model_.symmetries.distance(a, b) < 0.05 * model_.target.length &&
         model_.symmetries.angle_between(a, b) < radians(6);
}

std::vector<Pose> HypothesisAcquisition::proposed(const RangeImage& image, const PoseOdds& odds,
                                                  const std::vector<Vector3d>& points,
                                                  const std::vector<Hypothesis>& hints,
                                                  const Effort& effort) const {
  const double length = model_.target.length;
  const std::vector<Vector3d> spread = one_a_cube(points, 0.05 * length);
  const std::vector<Vector3d> anchors =
      effort.everywhere ? evenly(spread, effort.anchors) : middle_of(spread, effort.anchors);
  std::vector<Pose> poses;
  for (const Hypothesis& h : hints) poses.push_back(h.pose);
  for (const Placement& p : match_templates(image, points, anchors, templates_, model_.centre,
                                            model_.radius, length, effort.placements)) {
    poses.push_back(p.pose);
  }
  struct Weighed {
    Pose pose;
    double log_odds;
  };
  const auto laid = [&](const Pose& pose) {
    const Pose middle{pose * model_.centre, Quaterniond::Identity()};
    std::vector<Vector3d> near;
    for (const Vector3d& p : points) {
      const Vector3d q = p - middle.position;
      if (q.squaredNorm() < std::pow(1.1 * model_.radius, 2)) near.push_back(q);
    }
    return middle * lay_points(model_.grid, evenly(near, laid_points), pose.inverse() * middle,
                               0.06 * length, 0.015 * length, 6)
                        .inverse();
  };
  const int thinning = thinning_for(image, model_.radius, coarse_beams);
  std::vector<Weighed> weighed;
  for (const Pose& p : poses) {
    const Pose pose = laid(p);
    weighed.push_back({pose, odds.at(pose, 0.02 * length, thinning).log_odds});
  }
  std::stable_sort(weighed.begin(), weighed.end(),
                   [](const Weighed& a, const Weighed& b) { return a.log_odds > b.log_odds; });
  std::vector<Pose> best;
  for (const Weighed& w : weighed) {
    if (best.size() == effort.semifinalists) break;
    if (std::none_of(best.begin(), best.end(), [&](const Pose& b) { return same(b, w.pose); })) {
      best.push_back(w.pose);
    }
  }
  return best;
}

std::vector<HypothesisAcquisition::Mode> HypothesisAcquisition::modes(const RangeImage& image,
                                                                      const PoseOdds& odds,
                                                                      std::vector<Pose> poses,
                                                                      std::size_t finalists) const {
  const double length = model_.target.length;
  std::vector<Mode> best;
  const auto add = [&](const Pose& pose, double annealing, int thinning) {
    Mode mode{pose, odds.at(pose, annealing, thinning), 0};
    const auto twin =
        std::find_if(best.begin(), best.end(), [&](const Mode& m) { return same(m.pose, pose); });
    if (twin == best.end()) {
      best.push_back(mode);
    } else if (mode.at.log_odds > twin->at.log_odds) {
      *twin = mode;
    }
  };
  const auto sort = [&best](auto&& value) {
    std::stable_sort(best.begin(), best.end(),
                     [&](const Mode& a, const Mode& b) { return value(a) > value(b); });
  };
  const auto log_odds = [](const Mode& m) { return m.at.log_odds; };
  // Of the best so far, so many, each climbed further.
  const auto climb = [&](std::size_t count, double annealing, int thinning, int rounds) {
    sort(log_odds);
    if (best.size() > count) best.resize(count);
    for (const Mode& m : std::exchange(best, {})) {
      add(odds.climbed(m.pose, annealing * length, thinning, rounds), annealing * length, thinning);
    }
    sort(log_odds);
  };
  const int coarse = thinning_for(image, model_.radius, coarse_beams);
  const int middle = thinning_for(image, model_.radius, middle_beams);
  const auto first_climb = [&](const Pose& p) {
    add(odds.climbed(p, 0.02 * length, coarse, 0), 0.02 * length, coarse);
  };
  for (const Pose& p : poses) first_climb(p);
  sort(log_odds);
  // What the best are easily confused with: half turns about the axes that the target is spread
  // along, and its near symmetries.
  std::vector<Pose> alike;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, best.size()); ++i) {
    const Pose& p = best[i].pose;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d about = model_.canonical.pose.rotation.conjugate() * Vector3d::Unit(axis);
      Pose turn;
      turn.rotation = Quaterniond(Eigen::AngleAxisd(radians(180), about));
      turn.position = model_.centre - turn.rotation * model_.centre;
      alike.push_back(p * turn);
    }
    for (const Symmetry& s : model_.symmetries.motions) {
      if (!s.exact) alike.push_back(p * s.motion);
    }
  }
  for (const Pose& p : alike) first_climb(p);
  climb(4 * finalists, 0.02, middle, 0);
  climb(finalists, 0.007, middle, 3);
  if (!best.empty()) {
    const double highest = best.front().at.log_odds;
    const double enough = highest - no_rival * std::abs(highest);
    std::erase_if(best, [&](const Mode& m) { return m.at.log_odds < enough; });
  }

  poses.clear();
  for (const Mode& m : best) poses.push_back(m.pose);
  best.clear();
  const int fine = thinning_for(image, model_.radius, final_beams);
  for (const Pose& p : poses) {
    const Pose pose = odds.climbed(p, 0, fine, 3);
    Mode mode{pose, odds.at(pose, 0, fine), 0};
    if (std::none_of(best.begin(), best.end(), [&](const Mode& m) {
          return same(m.pose, pose) && m.at.log_odds >= mode.at.log_odds;
        })) {
      std::erase_if(best, [&](const Mode& m) { return same(m.pose, pose); });
      best.push_back(mode);
    }
  }
  // Evidence: odds at the mode times its share of all poses that were possible [MacKay, Information
  // Theory, Inference, and Learning Algorithms, ch. 28].
  const double volume = image.solid_angle() / 3 *
                        (std::pow(image.farthest(), 3) - std::pow(image.nearest(), 3)) * 8 *
                        9.8696 / model_.symmetries.exact_count();
  for (Mode& m : best) {
    Matrix6d information = m.at.information;
    information.diagonal().head<3>().array() += 1 / (length * length);
    information.diagonal().tail<3>().array() += 1;
    double log_determinant = 0;
    for (const double d : information.ldlt().vectorD()) log_determinant += std::log(d);
    m.log_evidence = m.at.log_odds + 3 * log_two_pi - 0.5 * log_determinant - std::log(volume);
  }
  sort([](const Mode& m) { return m.log_evidence; });
  return best;
}

AcquisitionResult HypothesisAcquisition::decided(const std::vector<Mode>& modes) const {
  AcquisitionResult result;
  result.candidates = static_cast<int>(modes.size());
  if (modes.empty()) {
    result.reason = "no view of the target lies on the returns";
    return result;
  }
  const double best = modes.front().log_evidence;
  double all = 0;
  for (const Mode& m : modes) all += std::exp(m.log_evidence - best);
  const double none = 1 / (1 + all * std::exp(std::min(best, 700.0)));
  for (const Mode& m : modes) {
    if (static_cast<int>(result.hypotheses.size()) == options_.max_hypotheses) break;
    Hypothesis h;
    h.pose = m.pose;
    h.log_likelihood = m.at.log_odds;
    h.probability = std::exp(m.log_evidence - best) / all;
    h.inlier_share = m.at.shares.hit;
    h.equal_poses = model_.symmetries.exact_count();
    h.constrained = true;
    if (!result.hypotheses.empty() && h.probability < options_.risk) break;
    result.hypotheses.push_back(h);
  }
  const Mode& first = modes.front();
  const double required = std::log((1 - options_.risk) / options_.risk);
  const PoseShares& w = first.at.shares;
  if (none > options_.risk) {
    result.reason = "the best pose has log odds of " + fixed(first.log_evidence, 1) +
                    " against no target there, " + fixed(required, 1) + " are required: of " +
                    fixed(first.at.expected, 0) + " beams that should meet it " +
                    fixed(100 * w.hit, 0) + " % did, " + fixed(100 * w.front, 0) +
                    " % stopped before it, " + fixed(100 * w.through, 0) + " % went through, " +
                    fixed(100 * w.missing, 0) + " % did not return";
    return result;
  }
  if (result.hypotheses.front().probability < 1 - options_.risk) {
    result.status = AcquisitionResult::Status::ambiguous;
    const double lead =
        modes.size() > 1 ? first.log_evidence - modes[1].log_evidence : first.log_evidence;
    result.reason = "the best pose leads the next by log odds of " + fixed(lead, 1) + ", " +
                    fixed(required, 1) + " are required";
    return result;
  }
  result.status = AcquisitionResult::Status::found;
  return result;
}

AcquisitionResult HypothesisAcquisition::acquire(const CleanScan& scan,
                                                 const std::vector<Hypothesis>& hints) const {
  if (static_cast<int>(scan.points.size()) < options_.min_returns) {
    AcquisitionResult result;
    result.reason = std::to_string(scan.points.size()) +
                    " returns inside the range gate, at least " +
                    std::to_string(options_.min_returns) + " are needed";
    return result;
  }
  const RangeImage image(scan, beam_model_);
  const PoseOdds odds(model_, image, surface_sigma_);
  const std::vector<Vector3d> points = searched(image, model_.radius);
  AcquisitionResult result;
  std::vector<Hypothesis> known = hints;
  for (const Effort& effort : {first_look, full_search}) {
    const std::vector<Mode> found =
        modes(image, odds, proposed(image, odds, points, known, effort), effort.finalists);
    result = decided(found);
    known.insert(known.end(), result.hypotheses.begin(), result.hypotheses.end());
    if (result.status != AcquisitionResult::Status::found) continue;
    const PoseOdds::At& at = found.front().at;
    if (at.shares.hit > explains_enough &&
        at.shares.hit * at.expected > explains_enough * static_cast<double>(points.size())) {
      break;
    }
  }
  result.noise_scale = image.noise_scale();
  return result;
}

AcquisitionResult HypothesisAcquisition::weigh(const CleanScan& scan,
                                               const std::vector<Pose>& poses) const {
  const RangeImage image(scan, beam_model_);
  const PoseOdds odds(model_, image, surface_sigma_);
  return decided(modes(image, odds, poses, full_search.finalists));
}

}  // namespace berth::estimator
