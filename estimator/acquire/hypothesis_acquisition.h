// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/acquire/acquisition.h"
#include "estimator/acquire/pose_odds.h"
#include "estimator/acquire/segmentation.h"
#include "estimator/acquire/template_match.h"

namespace berth::estimator {

struct HypothesisAcquisitionOptions {
  /// Probability, as the beams give it, that a pose called found is not the target's.
  double risk = 0.0025;
  /// Of a bare mesh: the true surface's distance from it, m, 1 sigma.
  double bare_surface_sigma_m = 0.004;
  int min_returns = 20;    ///< inside the gate, and of them on the target
  int max_hypotheses = 4;  ///< reported
};

/// Finds the target's pose without any prior, among whatever else is in view. Templates of all
/// views are laid on all returns but those of large planes; the best are laid on the surface, climb
/// the odds of their beams, and are weighed by evidence, as modes of one posterior over all poses
/// in view and "no target".
class HypothesisAcquisition final : public Acquisition {
 public:
  HypothesisAcquisition(const TargetModel& model, const BeamModel& beam_model,
                        const HypothesisAcquisitionOptions& options);

  using Acquisition::acquire;
  std::string name() const override { return "hypotheses"; }
  AcquisitionResult acquire(const CleanScan& scan,
                            const std::vector<Hypothesis>& hints) const override;
  /// What the posterior says of these poses, each climbed to where it is highest: not of others.
  AcquisitionResult weigh(const CleanScan& scan, const std::vector<Pose>& poses) const;

 private:
  struct Mode {
    Pose pose;
    PoseOdds::At at;
    double log_evidence = 0;       ///< of this mode against no target
    std::vector<double> of_beams;  ///< what each adds to at.log_odds
  };
  /// What may be the target's, and what is left out because it may hide it.
  struct Part {
    std::vector<int> beams;        ///< of the image
    std::vector<Vector3d> points;  ///< the same, sensor frame, m
    std::vector<char> hiding;      ///< of each beam
  };
  /// How much of a search is done.
  struct Effort {
    bool everywhere;  ///< else only where the target's middle is, if nearly all returns are its own
    std::size_t anchors;
    double max_cost;  ///< of a beam that a template has too many (match_templates)
    std::size_t placements;
    std::size_t semifinalists;
    std::size_t finalists;
    int rounds;  ///< of the first climb (PoseOdds::climbed)
  };
  static constexpr Effort first_look{false, 20, 1.5, 60, 6, 2, 0};
  /// Some piece may be elsewhere: by its prior (PoseOdds) that costs 4 nats, of about 20 beams.
  static constexpr Effort full_search{true, 300, 0.2, 600, 20, 5, 1};

  struct Behind {
    std::vector<Part> parts;
    std::vector<char> much_nearer;  ///< of each beam, whether what it met may be no target's
  };
  struct Searched;  ///< a scan

  Part without(const RangeImage& image, const LargePlanes& planes) const;
  Behind behind_surfaces(const RangeImage& image, const Part& all) const;
  Pose laid(const Pose& pose, const std::vector<Vector3d>& points, double gate) const;
  std::vector<Pose> proposed(const Searched& scan, const PoseOdds& odds, const Part& part,
                             const std::vector<Hypothesis>& hints, const Effort& effort) const;
  std::vector<Pose> half_turned(const Pose& pose, const Vector3d& place) const;
  std::vector<Pose> alike(const Pose& pose) const;
  std::vector<Pose> rivals(const Searched& scan, const Mode& best) const;
  std::vector<Pose> of_the_rest(const Searched& scan, const Mode& best) const;
  std::vector<Pose> climbed(const Searched& scan, const PoseOdds& odds,
                            const std::vector<Pose>& poses, const Effort& effort) const;
  void add_modes(const Searched& scan, const std::vector<Pose>& poses, std::vector<Mode>& modes,
                 double highest) const;
  double log_evidence(const RangeImage& image, const PoseOdds::At& at) const;
  Mode mode_at(const Searched& scan, const PoseOdds& odds, const Pose& pose) const;
  std::vector<Mode> priced(const Searched& scan, std::vector<Mode> modes) const;
  bool same(const Pose& a, const Pose& b) const;
  double required() const;  // log odds, of what is called found
  static void sort(std::vector<Mode>& modes);
  AcquisitionResult decided(const std::vector<Mode>& modes) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const HypothesisAcquisitionOptions& options_;
  double surface_sigma_;
};

}  // namespace berth::estimator
