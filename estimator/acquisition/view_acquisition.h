// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "estimator/acquisition/acquisition.h"
#include "estimator/acquisition/view_search.h"

namespace berth::estimator {

struct ViewAcquisitionOptions {
  int least_returns = 20;  ///< inside the gate
  int point_sets = 6;      ///< guesses of what is target and what is not, where everything is not
  int contenders = 24;     ///< poses weighed on beams
  int finalists = 6;       ///< of these, those that are fitted to the beams' ranges
  double decisive_margin = 4;        ///< log-likelihood by which the best must lead the second
  double least_evidence = 25;        ///< log-likelihood by which it must lead "no target at all"
  double least_explained = 0.75;     ///< share of the beams that should see the target that do
  double least_in_view = 0.4;        ///< share of all beams on the target that see it
  double least_inlier_share = 0.73;  ///< of the returns about the target that fit it
  double most_misfit_share = 0.12;   ///< of those on or beside its surface, those beside it
  int most_hypotheses = 4;
  ViewSearchOptions search;
  LikelihoodOptions likelihood;
};

/// Finds the target's pose without any prior and without asking for a shape: attitudes from an
/// atlas of views, the position from the cloud's centroid, weighed by distance tables; the best are
/// laid on the surface, and the beams, those that met nothing too, decide among them. Poses that
/// the target's own near symmetries make look alike are tried as well; those that its exact ones
/// make equal count as one.
class ViewAcquisition final : public Acquisition {
 public:
  ViewAcquisition(const TargetModel& model, const BeamModel& beam_model,
                  const ViewAcquisitionOptions& options)
      : model_(model), beam_model_(beam_model), options_(options) {}

  using Acquisition::acquire;
  std::string name() const override { return "views"; }
  AcquisitionResult acquire(const CleanScan& scan,
                            const std::vector<Hypothesis>& hints) const override;

 private:
  const TargetModel& model_;
  const BeamModel& beam_model_;
  const ViewAcquisitionOptions& options_;
};

}  // namespace berth::estimator
