// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/published/voxel_template_acquisition.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "estimator/model/align_points.h"
#include "estimator/published/beam_registration.h"

namespace berth::estimator {

namespace {

constexpr double half_turn = radians(180);

struct Finalist : Hypothesis {
  Likelihood fit;
  double inlier_share = 0;   // of the returns about the target
  bool constrained = false;  // the returns determine all six degrees of freedom
};

/// slack 1: for refined poses; larger: for starts that converge to the same one.
bool same_pose(const Pose& a, const Pose& b, const TargetModel& model, double slack = 1) {
  const double apart = (a * model.centre - b * model.centre).norm();
  return apart < slack * 0.06 * model.canonical.half_length &&
         angle_between(a, b) < slack * radians(4);
}

bool more_likely(const Hypothesis& a, const Hypothesis& b) {
  return a.log_likelihood > b.log_likelihood;
}

}  // namespace

std::string VoxelTemplateAcquisition::refusal() const {
  const double elongation = model_.canonical.elongation();
  if (elongation >= options_.min_elongation) return "";
  return "target '" + model_.target.name +
         "' is not elongated enough for its axis to be found: " + fixed(elongation, 2) +
         ", at least " + fixed(options_.min_elongation, 2) + " is needed";
}

std::vector<Pose> VoxelTemplateAcquisition::match_templates(
    const std::vector<PointSet>& sets) const {
  const VoxelTemplates& templates = model_.templates;
  // The visible centroid is off the model's by at most the radius across the axis, and along it by
  // more where the target is partly in view.
  const int reach_x =
      static_cast<int>(std::ceil(0.6 * model_.canonical.half_length / templates.cell()));
  const int reach_yz =
      static_cast<int>(std::ceil(0.8 * model_.canonical.radius / templates.cell()));
  std::vector<Pose> poses;
  for (const PointSet& set : sets) {
    // The target's major axis may be any principal axis of the visible points: seen obliquely it is
    // foreshortened.
    const Vector3d third = set.axis.cross(set.second);
    const Vector3d axes[] = {set.axis, -set.axis, set.second, -set.second, third, -third};
    for (const Vector3d& axis : axes) {
      // Any frame with the axis as x.
      const Quaterniond to_axis = Quaterniond::FromTwoVectors(axis, Vector3d::UnitX());
      std::vector<Vector3d> aligned;
      aligned.reserve(set.points.size());
      for (const Vector3d& p : set.points) aligned.push_back(to_axis * (p - set.centroid));
      std::vector<Correlation> found = templates.correlate(aligned, reach_x, reach_yz);
      std::stable_sort(found.begin(), found.end(),
                       [](const auto& a, const auto& b) { return a.score > b.score; });
      std::vector<int> taken;
      for (const Correlation& c : found) {
        if (static_cast<int>(taken.size()) >= options_.finalists_per_set) break;
        const bool is_near = std::any_of(taken.begin(), taken.end(), [&](int other) {
          const int apart = std::abs(other - c.rotation);
          return std::min(apart, templates.rotations() - apart) <= 2;
        });
        if (is_near || c.score == 0) continue;
        taken.push_back(c.rotation);
        const Pose turned{templates.cell() * Vector3d(c.shift[0], c.shift[1], c.shift[2]),
                          rotation_from_vector({templates.angle(c.rotation), 0, 0})};
        const Quaterniond from_axis = to_axis.conjugate();
        poses.push_back(Pose{set.centroid, from_axis} * turned * model_.canonical.pose);
      }
    }
  }
  return poses;
}

std::vector<Pose> VoxelTemplateAcquisition::twins(const Pose& pose, int turns) const {
  const Pose from_canonical = model_.canonical.pose.inverse();
  std::vector<Pose> result;
  for (const double flip : {0.0, half_turn}) {
    for (int turn = 0; turn < turns; ++turn) {
      if (flip == 0 && turn == 0) continue;
      const Quaterniond rotation = rotation_from_vector({2 * half_turn * turn / turns, 0, 0}) *
                                   rotation_from_vector({0, flip, 0});
      result.push_back(pose * from_canonical * Pose{Vector3d::Zero(), rotation} *
                       model_.canonical.pose);
    }
  }
  return result;
}

bool VoxelTemplateAcquisition::is_symmetry(const Pose& a, const Pose& b) const {
  // Both poses are noisy: first align the model with its rotated copy.
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < model_.surface.samples.size(); i += 8) {
    points.push_back(model_.surface.samples[i].position.cast<double>());
  }
  IcpOptions options;
  options.registration = Registration::point_to_plane;
  options.max_iterations = 15;
  options.start_gate_m = 0.03 * model_.canonical.half_length;
  options.min_gate_m = options.start_gate_m;
  const Pose to_model = align(model_, points, a.inverse() * b, options).pose.inverse();
  const double tolerance = 0.002 * model_.canonical.half_length;
  std::size_t off = 0;
  for (const Vector3d& p : points) {
    const Vector3d q = to_model * p;
    if ((model_.caster.nearest(q) - q).norm() > tolerance) ++off;
  }
  return off * 500 < points.size();
}

AcquisitionResult VoxelTemplateAcquisition::acquire(const PreprocessedScan& scan,
                                                    const std::vector<Hypothesis>& hints) const {
  AcquisitionResult result;
  result.reason = refusal();
  if (!result.reason.empty()) {
    result.status = AcquisitionResult::Status::refused;
    return result;
  }
  if (static_cast<int>(scan.points.size()) < options_.min_points) {
    result.reason = std::to_string(scan.points.size()) +
                    " returns inside the range gate, at least " +
                    std::to_string(options_.min_points) + " are needed";
    return result;
  }

  constexpr std::size_t max_points_matched = 2000;
  const std::vector<Vector3d> points = sampled_evenly(scan.points, max_points_matched);
  const std::vector<PointSet> sets =
      candidate_point_sets(points, {model_.canonical.half_length, model_.canonical.radius},
                           static_cast<std::size_t>(options_.point_sets));
  std::vector<Pose> poses;
  for (const Hypothesis& h : hints) poses.push_back(h.pose);
  for (const Pose& pose : match_templates(sets)) {
    const bool known = std::any_of(poses.begin(), poses.end(), [&](const Pose& other) {
      return same_pose(pose, other, model_, 2);
    });
    if (!known) poses.push_back(pose);
  }

  IcpOptions refinement;
  refinement.registration = Registration::point_to_plane;
  refinement.max_iterations = 10;
  refinement.start_gate_m = 0.16 * model_.canonical.half_length;
  refinement.stop_translation_m = 1e-3;
  refinement.stop_rotation_rad = 1e-3;
  const std::vector<Vector3d> sample = sampled_evenly(points, 300);
  const auto evaluate = [&](const Pose& pose, std::size_t stride) {
    Finalist h;
    h.pose = pose;
    h.fit = beam_likelihood(model_, beam_model_, scan.beams, pose, stride, options_.likelihood);
    h.log_likelihood = h.fit.log_likelihood;
    return h;
  };
  const std::size_t quick_stride = std::max<std::size_t>(1, scan.beams.size() / 1500);
  std::vector<Finalist> finalists;
  for (const Pose& pose : poses) {
    finalists.push_back(evaluate(align(model_, sample, pose, refinement).pose, quick_stride));
  }
  const auto keep_distinct = [&](std::size_t count) {
    std::stable_sort(finalists.begin(), finalists.end(), more_likely);
    std::vector<Finalist> kept;
    for (const Finalist& h : finalists) {
      const bool known = std::any_of(kept.begin(), kept.end(), [&](const Finalist& k) {
        return same_pose(k.pose, h.pose, model_);
      });
      if (!known) kept.push_back(h);
      if (kept.size() == count) break;
    }
    finalists = std::move(kept);
  };
  if (finalists.empty()) {
    result.reason = "no template fits the returns";
    return result;
  }
  // Confusable poses: the best pose is tried at all turns about its major axis, the next ones at
  // half turns only.
  keep_distinct(6);
  for (std::size_t i = 0, count = std::min<std::size_t>(finalists.size(), 3); i < count; ++i) {
    for (const Pose& twin : twins(finalists[i].pose, i == 0 ? 12 : 2)) {
      finalists.push_back(evaluate(align(model_, sample, twin, refinement).pose, quick_stride));
    }
  }
  keep_distinct(10);

  // Against the hypothesis that there is no target: every beam sees the background.
  Pose nowhere;
  nowhere.position = {0, 0, -1e6};
  const auto evidence_without = [&](std::size_t stride) {
    return beam_likelihood(model_, beam_model_, scan.beams, nowhere, stride, options_.likelihood)
        .log_likelihood;
  };
  const double lead = finalists.front().log_likelihood;
  const double pruning_limit = lead - 0.3 * std::max(20.0, lead - evidence_without(quick_stride));
  while (finalists.back().log_likelihood < pruning_limit) finalists.pop_back();

  // Final refinement: all points, nearly all beams.
  constexpr int beam_steps = 8;
  refinement.max_iterations = 20;
  refinement.start_gate_m = 0.08 * model_.canonical.half_length;
  refinement.stop_translation_m = 1e-4;
  refinement.stop_rotation_rad = 1e-4;
  const std::size_t stride = std::max<std::size_t>(1, scan.beams.size() / 6000);
  for (Finalist& h : finalists) {
    const IcpResult refined = align(model_, points, h.pose, refinement);
    // Beam registration or ICP: by the likelihood.
    Finalist by_points = evaluate(refined.pose, stride);
    Pose pose = refined.pose;
    for (int i = 0; i < beam_steps; ++i) {
      const double gate = i < 3 ? 0.1 : 0.05;
      pose = perturbed(pose, beam_step(model_, scan.beams, pose, gate, 2000).step);
    }
    const Finalist by_beams = evaluate(pose, stride);
    h = more_likely(by_beams, by_points) ? by_beams : by_points;
    h.inlier_share = refined.inlier_share();
    h.constrained = refined.constrained;
  }
  keep_distinct(10);

  // Poses related by a symmetry of the target are equal: the one with the smallest rotation from
  // the sensor's axes represents them.
  std::vector<Finalist> distinct;
  for (const Finalist& h : finalists) {
    const auto same = std::find_if(distinct.begin(), distinct.end(),
                                   [&](const Finalist& d) { return is_symmetry(d.pose, h.pose); });
    if (same == distinct.end()) {
      distinct.push_back(h);
      continue;
    }
    ++same->equal_poses;
    if (angle_between({}, h.pose) < angle_between({}, same->pose)) same->pose = h.pose;
  }

  const double best = distinct.front().log_likelihood;
  double sum = 0;
  for (const Finalist& h : distinct) sum += std::exp(h.log_likelihood - best);
  for (Finalist& h : distinct) h.probability = std::exp(h.log_likelihood - best) / sum;
  if (static_cast<int>(distinct.size()) > options_.max_hypotheses) {
    distinct.resize(static_cast<std::size_t>(options_.max_hypotheses));
  }
  result.hypotheses.assign(distinct.begin(), distinct.end());

  const double without = evidence_without(stride);
  const Finalist& winner = distinct.front();
  const double predicted = std::max(1, winner.fit.predicted);
  if (best - without < options_.min_evidence) {
    result.reason = "the best fit explains the scan hardly better than no target: log-likelihood " +
                    fixed(best - without, 0) + " more, at least " +
                    fixed(options_.min_evidence, 0) + " is needed";
    return result;
  }
  if (winner.fit.explained < options_.min_explained * predicted) {
    result.reason =
        "only " + fixed(100 * winner.fit.explained / predicted, 0) +
        " % of the beams that the best fit puts on the target return from it, at least " +
        fixed(100 * options_.min_explained, 0) + " % are needed";
    return result;
  }
  if (winner.fit.through > options_.max_through * predicted) {
    result.reason = fixed(100 * winner.fit.through / predicted, 0) +
                    " % of the beams go through the best fit, at most " +
                    fixed(100 * options_.max_through, 0) + " % may";
    return result;
  }
  if (winner.inlier_share < options_.min_inlier_share) {
    result.reason = "only " + fixed(100 * winner.inlier_share, 0) +
                    " % of the returns about the best fit belong to it, at least " +
                    fixed(100 * options_.min_inlier_share, 0) + " % are needed";
    return result;
  }
  if (!winner.constrained) {
    result.reason = "the returns do not determine all six degrees of freedom";
    return result;
  }
  if (distinct.size() > 1 && best - distinct[1].log_likelihood < options_.decisive_margin) {
    result.status = AcquisitionResult::Status::ambiguous;
    result.reason = "two poses explain the scan nearly equally well: log-likelihoods differ by " +
                    fixed(best - distinct[1].log_likelihood, 1) + ", " +
                    fixed(options_.decisive_margin, 1) + " decide";
    return result;
  }
  result.status = AcquisitionResult::Status::found;
  return result;
}

}  // namespace berth::estimator
