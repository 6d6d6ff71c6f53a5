// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquisition/view_acquisition.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "estimator/acquisition/beam_fit.h"
#include "estimator/acquisition/point_sets.h"
#include "estimator/acquisition/scan_order.h"

namespace berth::estimator {

namespace {

/// A pose in the running.
struct Contender {
  Pose pose;
  BeamLikelihood weight;

  double log_likelihood() const { return weight.sum().log_likelihood; }
};

bool leads(const Contender& a, const Contender& b) {
  return a.log_likelihood() > b.log_likelihood();
}

/// One scan, and all that is done with it.
class Work {
 public:
  Work(const TargetModel& model, const BeamModel& beam_model, const ViewAcquisitionOptions& options,
       const CleanScan& scan)
      : model_(model), beam_model_(beam_model), options_(options), scan_(scan) {
    order_ = shuffled(scan.beams);
    std::vector<bool> gated(scan.beams.size());
    for (const std::uint32_t i : scan.beam_of_point) gated[i] = true;
    for (const std::uint32_t i : order_) {
      if (hits_.size() == most_hits) break;
      if (gated[i]) hits_.push_back(scan.beams[i]);
    }
  }

  bool same(const Pose& a, const Pose& b, double slack) const {
    const Pose near = model_.symmetries.nearest_equal(a, b);
    return near.rotation.angularDistance(b.rotation) < slack * radians(4) &&
           (near * model_.centre - b * model_.centre).norm() < slack * 0.03 * model_.target.length;
  }

  /// Weighs poses on more and more beams, and leaves out those that are hopeless. Best first.
  std::vector<Contender> race(const std::vector<Pose>& poses, const LikelihoodOptions& likelihood,
                              std::size_t most_beams, std::size_t block, double hopeless,
                              std::size_t enough_beams) const {
    std::vector<Contender> running;
    for (const Pose& pose : poses) {
      running.push_back({pose, BeamLikelihood(model_, beam_model_, likelihood, pose)});
    }
    const std::size_t end = std::min(most_beams, order_.size());
    for (std::size_t from = 0; from < end; from += block) {
      if (all_the_same(running) && from >= enough_beams) break;
      const std::size_t to = std::min(from + block, end);
      for (Contender& c : running) {
        for (std::size_t i = from; i < to; ++i) c.weight.add(scan_.beams[order_[i]]);
      }
      std::stable_sort(running.begin(), running.end(), leads);
      const double least = running.front().log_likelihood() - hopeless;
      while (running.back().log_likelihood() < least) running.pop_back();
    }
    return running;
  }

  bool all_the_same(const std::vector<Contender>& running) const {
    return std::all_of(running.begin() + 1, running.end(),
                       [&](const Contender& c) { return same(c.pose, running.front().pose, 0.7); });
  }

  std::vector<Pose> distinct(const std::vector<Pose>& poses, std::size_t most, double slack) const {
    std::vector<Pose> result;
    for (const Pose& pose : poses) {
      if (result.size() == most) break;
      if (std::none_of(result.begin(), result.end(),
                       [&](const Pose& other) { return same(pose, other, slack); })) {
        result.push_back(pose);
      }
    }
    return result;
  }

  std::vector<Contender> distinct_contenders(const std::vector<Contender>& all) const {
    std::vector<Contender> result;
    for (const Contender& c : all) {
      if (std::none_of(result.begin(), result.end(),
                       [&](const Contender& other) { return same(c.pose, other.pose, 0.7); })) {
        result.push_back(c);
      }
    }
    return result;
  }

  std::vector<Pose> fitted(const std::vector<Pose>& poses, std::size_t beams, double first_gate,
                           double last_gate, int iterations) const {
    const std::span<const Beam> some(hits_.data(), std::min(beams, hits_.size()));
    std::vector<Pose> result;
    for (const Pose& pose : poses) {
      result.push_back(
          fit_beams(model_, beam_model_, some, pose, first_gate, last_gate, iterations).pose);
    }
    return result;
  }

  /// Shares of drop-outs, outliers and background as a leading pose shows them.
  LikelihoodOptions nuisance_of(const Contender& leader) const {
    constexpr double prior = 20;  // beams' worth of what the options say
    const auto share = [](int count, int of, double expected) {
      return (count + prior * expected) / (of + prior);
    };
    const Likelihood& seen = leader.weight.sum();
    LikelihoodOptions result = options_.likelihood;
    const int strays = seen.predicted - seen.explained - seen.missed;
    result.background = share(seen.past_returned, seen.past, result.background);
    result.drop_out = std::min(0.3, share(seen.missed, seen.predicted, result.drop_out));
    result.outlier = std::min(0.5, share(strays, seen.predicted, result.outlier));
    return result;
  }

  /// Share of the returns about the target in a pose that the pose explains.
  double inlier_share(const Contender& c) const {
    const Likelihood& seen = c.weight.sum();
    const Vector3d centre = c.pose * model_.centre;
    int near = 0;
    for (int i = 0; i < seen.predicted + seen.past; ++i) {
      const Beam& beam = scan_.beams[order_[static_cast<std::size_t>(i)]];
      if (beam.hit() && (beam.point() - centre).norm() < model_.radius) ++near;
    }
    return near > 0 ? static_cast<double>(seen.explained) / near : 0;
  }

  /// Log-likelihood of the beams by which a pose was weighed if there were no target.
  double evidence_without(const Contender& c, const LikelihoodOptions& likelihood) const {
    Pose nowhere;
    nowhere.position = {0, 0, -1e6};
    BeamLikelihood without(model_, beam_model_, likelihood, nowhere);
    const Likelihood& seen = c.weight.sum();
    for (int i = 0; i < seen.predicted + seen.past; ++i) {
      without.add(scan_.beams[order_[static_cast<std::size_t>(i)]]);
    }
    return without.sum().log_likelihood;
  }

  /// Why the best pose is none; empty when nothing speaks against it.
  std::string objection(const Contender& best, const LikelihoodOptions& likelihood) const {
    const Likelihood& fit = best.weight.sum();
    const double lead = fit.log_likelihood - evidence_without(best, likelihood);
    if (lead < options_.least_evidence) {
      return "the best fit explains the scan hardly better than no target: log-likelihood " +
             fixed(lead, 0) + " more, at least " + fixed(options_.least_evidence, 0) + " is needed";
    }
    const double visible = std::max(1, fit.predicted - fit.occluded());
    if (fit.explained < options_.least_explained * visible) {
      return "only " + fixed(100 * fit.explained / visible, 0) +
             " % of the beams that the best fit puts on the target return from it, at least " +
             fixed(100 * options_.least_explained, 0) + " % are needed";
    }
    if (const double share = inlier_share(best); share < options_.least_inlier_share) {
      return "only " + fixed(100 * share, 0) +
             " % of the returns about the best fit belong to it, at least " +
             fixed(100 * options_.least_inlier_share, 0) + " % are needed";
    }
    return "";
  }

  const std::vector<Beam>& hits() const { return hits_; }
  static constexpr std::size_t most_hits = 1500;

 private:
  const TargetModel& model_;
  const BeamModel& beam_model_;
  const ViewAcquisitionOptions& options_;
  const CleanScan& scan_;
  std::vector<std::uint32_t> order_;
  std::vector<Beam> hits_;  // inside the gate, in this order
};

std::vector<Pose> poses_of(const std::vector<Contender>& contenders) {
  std::vector<Pose> result;
  for (const Contender& c : contenders) result.push_back(c.pose);
  return result;
}

void append(std::vector<Pose>& to, const std::vector<Pose>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

}  // namespace

AcquisitionResult ViewAcquisition::acquire(const CleanScan& scan,
                                           const std::vector<Pose>& hints) const {
  AcquisitionResult result;
  if (static_cast<int>(scan.points.size()) < options_.least_returns) {
    result.reason = std::to_string(scan.points.size()) +
                    " returns inside the range gate, at least " +
                    std::to_string(options_.least_returns) + " are needed";
    return result;
  }
  const double length = model_.target.length;
  const auto most = static_cast<std::size_t>(options_.finalists);
  const Work work(model_, beam_model_, options_, scan);

  const auto search = [&](const std::vector<Vector3d>& points, const Vector3d& centroid) {
    ++result.point_sets;
    std::vector<Pose> poses;
    const auto count = static_cast<std::size_t>(options_.search.second_points);
    for (const Candidate& c : search_views(model_, spread_points(points, count), centroid,
                                           {Vector3d::Zero()}, options_.search)) {
      poses.push_back(c.pose);
    }
    return work.distinct(poses, static_cast<std::size_t>(options_.contenders), 1);
  };

  LikelihoodOptions fine = options_.likelihood;
  // From rough poses to those few between which all beams decide.
  const auto settle = [&](std::vector<Pose> poses) {
    LikelihoodOptions coarse = options_.likelihood;
    coarse.drop_out = std::max(coarse.drop_out, 0.1);
    coarse.outlier = std::max(coarse.outlier, 0.1);
    coarse.model_sigma_m = std::max(coarse.model_sigma_m, 0.006 * length);
    poses = poses_of(work.race(poses, coarse, 256, 64, 25, 256));
    if (poses.size() > most) poses.resize(most);
    // A fit to few returns may go astray: the likelihood tells.
    append(poses, work.fitted(poses, 256, 0.02 * length, 0.008 * length, 3));
    coarse.model_sigma_m = std::max(options_.likelihood.model_sigma_m, 0.003 * length);
    const std::vector<Contender> roughly = work.race(poses, coarse, 256, 64, 25, 256);
    fine = work.nuisance_of(roughly.front());
    poses = work.distinct(poses_of(roughly), most, 0.7);
    append(poses, work.fitted(poses, 400, 0.008 * length, 0.008 * length, 2));
    poses = work.distinct(poses_of(work.race(poses, fine, 512, 64, 25, 256)), most, 0.7);
    // What a target is confused with: itself, turned.
    const std::size_t leaders = std::min<std::size_t>(poses.size(), 2);
    for (std::size_t i = 0; i < leaders; ++i) {
      for (const Symmetry& s : model_.symmetries.motions) {
        if (!s.exact) poses.push_back(poses[i] * s.motion);
      }
    }
    result.candidates += static_cast<int>(poses.size());
    return work.distinct_contenders(work.race(poses, fine, scan.beams.size(), 64, 25, 1000));
  };
  const auto explains_the_scan = [&](const Contender& best) {
    constexpr double well = 0.6;
    return work.objection(best, fine).empty() && work.inlier_share(best) > well;
  };

  std::vector<Contender> last;
  if (!hints.empty()) last = settle(hints);
  if (last.empty() || !explains_the_scan(last.front())) {
    std::vector<Vector3d> points;
    for (const Beam& beam : work.hits()) points.push_back(beam.point());
    Vector3d centroid = Vector3d::Zero();
    for (const Vector3d& p : scan.points) centroid += p;
    centroid /= static_cast<double>(scan.points.size());
    std::vector<Pose> poses = poses_of(last);
    append(poses, search(points, centroid));
    last = settle(poses);
    if (!explains_the_scan(last.front())) {
      poses = poses_of(last);
      for (const PointSet& set :
           candidate_point_sets(points, {0.5 * length, model_.radius},
                                static_cast<std::size_t>(options_.point_sets))) {
        append(poses, search(set.points, set.centroid));
      }
      last = settle(poses);
    }
  }

  const double best = last.front().log_likelihood();
  double sum = 0;
  for (const Contender& c : last) sum += std::exp(c.log_likelihood() - best);
  for (const Contender& c : last) {
    if (static_cast<int>(result.hypotheses.size()) == options_.most_hypotheses) break;
    Hypothesis h;
    h.pose = c.pose;
    h.log_likelihood = c.log_likelihood();
    h.probability = std::exp(c.log_likelihood() - best) / sum;
    h.fit = c.weight.sum();
    h.inlier_share = work.inlier_share(c);
    h.equal_poses = model_.symmetries.exact_count();
    h.constrained = true;
    result.hypotheses.push_back(h);
  }
  result.reason = work.objection(last.front(), fine);
  if (!result.reason.empty()) return result;
  if (last.size() > 1 && best - last[1].log_likelihood() < options_.decisive_margin) {
    result.status = AcquisitionResult::Status::ambiguous;
    result.reason = "two poses explain the scan nearly equally well: log-likelihoods differ by " +
                    fixed(best - last[1].log_likelihood(), 1) + ", " +
                    fixed(options_.decisive_margin, 1) + " decide";
    return result;
  }
  result.status = AcquisitionResult::Status::found;
  return result;
}

}  // namespace berth::estimator
