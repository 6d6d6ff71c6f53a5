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
  /// Probability, under the model, that a pose reported as found is wrong.
  double risk = 0.0025;
  /// Of a bare mesh: the true surface's distance from it, m, 1 sigma.
  double bare_surface_sigma_m = 0.004;
  int min_returns = 20;    ///< inside the gate, and on the target
  int max_hypotheses = 4;  ///< reported
};

/// Acquisition among clutter by hypothesis tests. Templates of all views are matched with all
/// returns outside large planes; the best are aligned to the surface, refined by their odds, and
/// compared by evidence, as modes of one posterior over all poses in view and "no target".
class HypothesisAcquisition final : public Acquisition {
 public:
  HypothesisAcquisition(const TargetModel& model, const BeamModel& beam_model,
                        const HypothesisAcquisitionOptions& options);

  using Acquisition::acquire;
  std::string name() const override { return "hypotheses"; }
  AcquisitionResult acquire(const PreprocessedScan& scan,
                            const std::vector<Hypothesis>& hints) const override;
  /// The posterior of these poses, each refined to its local maximum, among each other.
  AcquisitionResult evaluate(const PreprocessedScan& scan, const std::vector<Pose>& poses) const;

 private:
  /// A local maximum of the odds.
  struct Mode {
    Pose pose;
    PoseOdds::At at;
    double log_evidence = 0;       ///< against "no target"
    std::vector<double> of_beams;  ///< contribution of each beam to at.log_odds
  };
  /// Returns that may be the target's; the others are excluded as possible occluders.
  struct Candidates {
    std::vector<int> beams;        ///< of the image
    std::vector<Vector3d> points;  ///< the same, sensor frame, m
    std::vector<char> occluding;   ///< of each beam
  };
  /// Extent of a search.
  struct SearchSettings {
    bool everywhere;  ///< else anchors are taken near the mean of all returns only
    std::size_t anchors;
    double max_cost;  ///< per beam without return where a template has a point (match_templates)
    std::size_t placements;
    std::size_t semifinalists;
    std::size_t finalists;
    int rounds;  ///< of the first refinement (PoseOdds::refined)
  };
  static constexpr SearchSettings quick_search{false, 20, 1.5, 60, 6, 2, 0};
  /// A missing piece costs 4 nats by its prior (PoseOdds), spread over about 20 beams.
  static constexpr SearchSettings full_search{true, 300, 0.2, 600, 20, 5, 1};

  /// Candidates behind each near surface.
  struct Layers {
    std::vector<Candidates> parts;
    std::vector<char>
        possible_occluders;  ///< of each beam, whether its return may be of another body
  };
  /// A scan, prepared for the search.
  struct SearchData;  ///< a scan

  Candidates without(const RangeImage& image, const LargePlanes& planes) const;
  Layers search_behind(const RangeImage& image, const Candidates& all) const;
  Pose aligned(const Pose& pose, const std::vector<Vector3d>& points, double gate) const;
  std::vector<Pose> proposed(const SearchData& scan, const PoseOdds& odds,
                             const Candidates& candidates, const std::vector<Hypothesis>& hints,
                             const SearchSettings& settings) const;
  std::vector<Pose> half_turned(const Pose& pose, const Vector3d& place) const;
  std::vector<Pose> confusable_poses(const Pose& pose) const;
  std::vector<Pose> rivals(const SearchData& scan, const Mode& best) const;
  std::vector<Pose> unexplained_poses(const SearchData& scan, const Mode& best) const;
  std::vector<Pose> refined(const SearchData& scan, const PoseOdds& odds,
                            const std::vector<Pose>& poses, const SearchSettings& settings) const;
  void add_modes(const SearchData& scan, const std::vector<Pose>& poses, std::vector<Mode>& modes,
                 double highest) const;
  double log_evidence(const RangeImage& image, const PoseOdds::At& at) const;
  Mode mode_at(const SearchData& scan, const PoseOdds& odds, const Pose& pose) const;
  std::vector<Mode> with_plane_costs(const SearchData& scan, std::vector<Mode> modes) const;
  bool same(const Pose& a, const Pose& b) const;
  double required_log_odds() const;  // of a pose reported as found
  static void sort(std::vector<Mode>& modes);
  AcquisitionResult decision(const std::vector<Mode>& modes) const;

  const TargetModel& model_;
  const BeamModel& beam_model_;
  const HypothesisAcquisitionOptions& options_;
  double surface_sigma_;
};

}  // namespace berth::estimator
