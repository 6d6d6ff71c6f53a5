// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/hypothesis_acquisition.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "estimator/acquire/large_planes.h"

namespace berth::estimator {
namespace {

// Choices of cost.
constexpr int coarse_beams = 300;  // in the target's sphere, of which poses are first weighed
constexpr int middle_beams = 800;
constexpr std::size_t semifinalists = 20;
constexpr std::size_t finalists = 5;

/// Planes wider than this, in radii of the target's sphere, cannot be the target's.
constexpr double too_wide = 2.15;
constexpr double log_two_pi = 1.8378770664093453;

double surface_sigma_of(const TargetModel& model, double bare) {
  if (model.target.description_hash.empty()) return bare;
  double largest = 0;
  for (const TargetPart& part : model.target.parts) largest = std::max(largest, part.surface_sigma);
  return largest;
}

/// Every so many-th beam, so that about so many are in a sphere of that radius at the range of the
/// returns.
int thinning_for(const RangeImage& image, double radius, int beams) {
  const double middle = 0.5 * (image.nearest() + image.farthest());
  const double inside = std::min(static_cast<double>(image.beams().size()),
                                 3.14159 * std::pow(radius / (middle * image.spacing()), 2));
  return std::max(1, static_cast<int>(inside / beams));
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
                                                  const std::vector<Hypothesis>& hints) const {
  const double length = model_.target.length;
  const std::vector<char> left_out =
      on_large_planes(image, too_wide * model_.radius, beam_model_.range_sigma_m);
  std::vector<Vector3d> points;
  for (std::size_t b = 0; b < left_out.size(); ++b) {
    const Beam& beam = image.beams()[b];
    if (left_out[b] == 0 && beam.hit() && beam.range >= image.nearest() &&
        beam.range <= image.farthest()) {
      points.push_back(beam.point());
    }
  }
  std::vector<Pose> poses;
  for (const Hypothesis& h : hints) poses.push_back(h.pose);
  for (const Placement& p : match_templates(image, points, templates_, model_.centre, model_.radius,
                                            length, options_.match)) {
    poses.push_back(p.pose);
  }
  struct Weighed {
    Pose pose;
    double log_odds;
  };
  const int thinning = thinning_for(image, model_.radius, coarse_beams);
  std::vector<Weighed> weighed;
  for (const Pose& p : poses) {
    const Pose laid = laid_on(model_, p, points, 0.1 * length, 0.03 * length, 6);
    weighed.push_back({laid, odds.at(laid, 0.02 * length, thinning).log_odds});
  }
  std::stable_sort(weighed.begin(), weighed.end(),
                   [](const Weighed& a, const Weighed& b) { return a.log_odds > b.log_odds; });
  std::vector<Pose> best;
  for (const Weighed& w : weighed) {
    if (best.size() == semifinalists) break;
    if (std::none_of(best.begin(), best.end(), [&](const Pose& b) { return same(b, w.pose); })) {
      best.push_back(w.pose);
    }
  }
  return best;
}

std::vector<HypothesisAcquisition::Mode> HypothesisAcquisition::modes(
    const RangeImage& image, const PoseOdds& odds, std::vector<Pose> poses) const {
  const double length = model_.target.length;
  const int thinning = thinning_for(image, model_.radius, middle_beams);
  const auto climb = [&](const Pose& pose, double from, double to, int thin) {
    return odds.climbed(odds.climbed(pose, from * length, thin, 2), to * length, thin, 3);
  };
  std::vector<Mode> best;
  const auto add = [&](const Pose& pose, double annealing) {
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
  for (const Pose& p : poses) add(climb(p, 0.02, 0.007, thinning), 0.007 * length);
  sort(log_odds);
  if (best.size() > finalists) best.resize(finalists);
  // What a finalist is easily confused with: half turns about the axes that it is spread along, and
  // the target's near symmetries.
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
  for (const Pose& p : alike) add(climb(p, 0.02, 0.007, thinning), 0.007 * length);
  sort(log_odds);
  if (best.size() > finalists) best.resize(finalists);

  poses.clear();
  for (const Mode& m : best) poses.push_back(m.pose);
  best.clear();
  for (const Pose& p : poses) {
    const Pose pose = odds.climbed(odds.climbed(p, 0.003, 1, 2), 0, 1, 3);
    Mode mode{pose, odds.at(pose, 0, 1), 0};
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
  const double best = std::max(0.0, modes.front().log_evidence);
  double all = std::exp(-best);
  for (const Mode& m : modes) all += std::exp(m.log_evidence - best);
  const double none = std::exp(-best) / all;
  for (const Mode& m : modes) {
    if (static_cast<int>(result.hypotheses.size()) == options_.max_hypotheses) break;
    Hypothesis h;
    h.pose = m.pose;
    h.log_likelihood = m.at.log_odds;
    h.probability = std::exp(m.log_evidence - best) / (all * std::max(1e-300, 1 - none));
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
  const PoseOdds odds(model_, beam_model_, image, surface_sigma_);
  return decided(modes(image, odds, proposed(image, odds, hints)));
}

AcquisitionResult HypothesisAcquisition::weigh(const CleanScan& scan,
                                               const std::vector<Pose>& poses) const {
  const RangeImage image(scan, beam_model_);
  const PoseOdds odds(model_, beam_model_, image, surface_sigma_);
  return decided(modes(image, odds, poses));
}

}  // namespace berth::estimator
