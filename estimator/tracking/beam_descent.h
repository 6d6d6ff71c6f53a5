// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <initializer_list>
#include <limits>
#include <optional>

#include "estimator/tracking/beam_information.h"
#include "estimator/tracking/beam_selection.h"
#include "estimator/tracking/edge_rest.h"
#include "estimator/tracking/motion_prior.h"
#include "estimator/tracking/open_directions.h"
#include "estimator/tracking/outline.h"
#include "estimator/tracking/tracking.h"

namespace berth::estimator {

struct BeamDescentOptions {
  BeamInformationOptions information;
  int settle_returns = 150;    ///< of a scan, on which a fit begins
  int checked_misses = 300;    ///< beams without a return that have a say in the end
  int settle_steps = 10;       ///< at most
  double pull_sigma_m = 0.03;  ///< see BeamInformationOptions; only at first
  double gate_shrink = 0.1;    ///< of the gate's variance, from step to step
  int polish_steps = 3;        ///< on all beams, at most
  /// Standard deviation by which edges are blurred on which a pose rests: where they are is seen no
  /// better than beams are apart. Of that distance, and at least, m.
  double edge_blur = 0.3;
  double least_edge_blur_m = 0.001;
  OpenDirectionsOptions open_directions;
  EdgeRestOptions edge_rest;
};

/// Gauss-Newton on the likelihood of one scan's beams: on few of them with a wide gate, on all that
/// meet one face whatever the pose may be, then with the others (EdgePropagation). The likelihood
/// has many optima; the best that was met is kept. A velocity that is not known is estimated
/// together with the pose in the last steps: a scan takes time, and what is seen first and last
/// hangs together by the velocity alone. Where angles blur edges it only widens the covariance.
class BeamDescent {
 public:
  struct Result {
    Motion motion;                               ///< at the scan's mean time
    Matrix6d covariance = Matrix6d::Identity();  ///< of its pose
    Matrix12d information = Matrix12d::Zero();   ///< of the returns alone
    BeamInformation sums;                        ///< counts, chi2 and cost there
    int steps = 0;
  };

  /// What is passed in must outlive it.
  BeamDescent(const TargetModel& model, const BeamModel& beam_model, const CleanScan& scan,
              const Prediction& predicted, const BeamDescentOptions& options, bool deskew);

  /// From a start within some decimetres, unless few returns already lead to the best known.
  void run(const Pose& start);
  /// From a start within some millimetres.
  void refine(const Pose& start);
  using Judgement = std::function<bool(const Result&)>;
  /// When the best is doubtful: from the likelier of what faces said and the prediction, on edges
  /// so blurred at first that they are seen from a slip away; and unless that settles it, along the
  /// directions that faces leave open. Where edges lead to what faces said, it is enough that it is
  /// credible. To be followed by rest().
  void search(const Judgement& settled, const Judgement& credible);
  /// From the best to where hits and misses about edges put it, too; there some beams are counted,
  /// for all.
  void rest();
  const Result& best() const { return best_; }
  /// What the returns alone say of pose and velocity. Nothing where the velocity is known.
  std::optional<MeasuredMotion> measured() const;
  /// Whether edges count to the last, where a return may be of several faces: then sums.chi2 is
  /// less than the noise.
  bool blurred() const { return blurred_; }

 private:
  /// Returns and outline.
  struct Outlined {
    BeamPicks all, few;  // of these, spread evenly
  };

  void start_from(const Motion& motion);
  void settle();
  void close_in();
  void sharpen(std::initializer_list<double> scales_m);
  Result polish();
  void take(Result result);
  void rest_on_edges(std::initializer_list<double> scales_m, double last_m);
  void consider_velocity();
  void count();
  bool wide() const { return options_.information.likelihood.footprint; }
  BeamInformation certain_faces(const BeamPicks& picks, std::vector<MetFace>& near) const;
  BeamInformationOptions on_faces() const;
  Result settled_at() const;
  Result known_by_faces() const;
  Result found_at(const Motion& motion) const;
  bool take_if_likelier(Result other, double tolerance = 0);
  double weigh(Result& result) const;
  BeamInformation faces_at(const Motion& motion, const BeamPicks& picks) const;
  double beam_spacing() const;
  Matrix6d blur(double scale_m) const;
  double moved_since(const Pose& before) const;
  const Outlined& outlined();
  double step_on_faces(const BeamPicks& picks);
  double step(const BeamInformationOptions& how, const BeamPicks& picks);
  double take_step(const BeamInformation& sums, bool of_velocity);

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const CleanScan& scan_;
  const Prediction& predicted_;
  const BeamDescentOptions& options_;
  MotionPrior prior_;
  BeamInformationOptions pose_only_;
  bool velocity_uncertain_;
  bool blurred_;
  bool among_edges_;  ///< whether it comes to rest there
  BeamSelection beams_;
  Outline outline_;
  std::optional<Outlined> outlined_;  ///< once it is needed
  BeamLinearisation at_;
  BeamInformation sums_;
  Matrix6d covariance_ = Matrix6d::Identity();
  Matrix12d information_ = Matrix12d::Zero();
  int steps_ = 0;
  bool known_ = false;  ///< a best
  double best_cost_ = std::numeric_limits<double>::infinity();
  Result best_;
  std::optional<Result> by_faces_;  ///< the best before it came to rest among edges
};

}  // namespace berth::estimator
