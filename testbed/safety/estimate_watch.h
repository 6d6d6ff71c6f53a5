// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>

#include "testbed/safety/arm_watch.h"
#include "testbed/truth/ground_truth.h"

namespace berth::testbed {

/// Compares estimates with ground truth of the same time. The supervisor alone may: guidance flies
/// by the estimate.
///
/// An estimate contradicts truth when its position is further away than a margin and four sigmas of
/// both together: the largest axis of the sum of both covariances. Attitudes are not compared: a
/// symmetric target has several correct ones.
class EstimateWatch {
 public:
  struct Settings {
    double margin = 0.15;        ///< m
    double margin_share = 0.01;  ///< of the range, where that is more
  };
  struct Position {
    std::int64_t utime = 0;
    Vector3d position = Vector3d::Zero();  ///< m, of T_sensor_model
    Matrix3d covariance = Matrix3d::Zero();
  };

  explicit EstimateWatch(Settings settings) : settings_(settings) {}

  void on_truth(const Truth& truth);
  /// Of a usable estimate. One without ground truth near its time is not judged.
  void on_estimate(const Position& estimate);
  /// After an estimate that is not usable.
  void forget() { contradiction_.reset(); }
  /// Contradiction of the newest estimate; none: it is accepted.
  const std::optional<Contradiction>& contradiction() const { return contradiction_; }

 private:
  Settings settings_;
  std::deque<Position> truths_;
  std::optional<Contradiction> contradiction_;
};

}  // namespace berth::testbed
