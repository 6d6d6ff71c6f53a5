// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/safety/estimate_watch.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "common/core/text.h"

namespace berth::testbed {
namespace {

constexpr std::int64_t kept = 5000000;           // us of truth
constexpr std::int64_t farthest_truth = 100000;  // us from the estimate's time

}  // namespace

void EstimateWatch::on_truth(const Truth& truth) {
  truths_.push_back({truth.utime, truth.pose.position, truth.covariance.topLeftCorner<3, 3>()});
  while (truths_.front().utime < truth.utime - kept) truths_.pop_front();
}

void EstimateWatch::on_estimate(const Position& estimate) {
  const auto after =
      std::lower_bound(truths_.begin(), truths_.end(), estimate.utime,
                       [](const Position& truth, std::int64_t t) { return truth.utime < t; });
  const Position* truth = nullptr;
  if (after != truths_.end()) {
    truth = &*after;  // the grid is fine: the nearest will do
  } else if (!truths_.empty()) {
    truth = &truths_.back();
  }
  if (truth == nullptr || std::abs(truth->utime - estimate.utime) > farthest_truth) return;
  const double away = (estimate.position - truth->position).norm();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> axes(estimate.covariance + truth->covariance,
                                                     Eigen::EigenvaluesOnly);
  const double sigma = std::sqrt(std::max(0.0, axes.eigenvalues()[2]));
  const double allowed =
      std::max(settings_.margin, settings_.margin_share * truth->position.norm()) + 4 * sigma;
  contradiction_.reset();
  if (away <= allowed) return;  // also rejects NaN
  contradiction_ = Contradiction{"estimate-wrong",
                                 "the estimate is " + fixed(1e3 * away, 0) +
                                     " mm away from ground truth; with the uncertainty of both " +
                                     fixed(1e3 * allowed, 0) + " mm are allowed"};
}

}  // namespace berth::testbed
