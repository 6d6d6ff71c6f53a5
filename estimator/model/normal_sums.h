// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "common/core/pose.h"
#include "estimator/model/lanes.h"

namespace berth::estimator {

/// Sums of Gauss-Newton rows, w J J^T and w r J, a few rows at a time in vector registers. The
/// order of summation is fixed: the same bits every time.
class NormalSums {
 public:
  NormalSums() {
    products_.fill(Lane::Zero());
    residuals_.fill(Lane::Zero());
  }

  /// Four rows J = [normal; torque] with weights w, weights times residuals wr.
  void add(const Four3& normal, const Four3& torque, const Four& w, const Four& wr) {
    const Lane weight = lane(w);
    const Lane residual = lane(wr);
    const std::array<Lane, 6> j = {lane(normal.x), lane(normal.y), lane(normal.z),
                                   lane(torque.x), lane(torque.y), lane(torque.z)};
    std::size_t k = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const Lane weighted = weight * j[i];
      for (std::size_t n = i; n < 6; ++n) products_[k++] += weighted * j[n];
    }
    for (std::size_t i = 0; i < 6; ++i) residuals_[i] += residual * j[i];
  }

  /// Sum of w J J^T.
  Matrix6d products() const {
    Matrix6d a;
    std::size_t k = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = i; j < 6; ++j) a(i, j) = a(j, i) = products_[k++].sum();
    }
    return a;
  }
  /// Sum of w r J.
  Vector6d residuals() const {
    Vector6d b;
    for (std::size_t i = 0; i < 6; ++i) b[static_cast<Eigen::Index>(i)] = residuals_[i].sum();
    return b;
  }

 private:
  using Lane = Eigen::Array4d;

  static Lane lane(const Four& value) { return {value[0], value[1], value[2], value[3]}; }

  std::array<Lane, 21> products_;
  std::array<Lane, 6> residuals_;
};

}  // namespace berth::estimator
