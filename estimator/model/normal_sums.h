// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "common/core/pose.h"
#include "estimator/model/lanes.h"

namespace berth::estimator {

/// Sums of Gauss-Newton rows, t^k w J J^T and t^k w r J, a few rows at a time in vector registers.
/// The order of summation is fixed: the same bits every time.
class NormalSums {
 public:
  /// Room that one call of add() may need: flush() when less is left.
  static constexpr std::size_t capacity = 64;

  /// timed: whether powers of the time above 0 are wanted.
  explicit NormalSums(bool timed) : timed_(timed) {
    for (auto& power : products_) power.fill(Lane::Zero());
    for (auto& power : residuals_) power.fill(Lane::Zero());
  }

  /// A row J = [normal; torque] with weight w, weight times residual wr, at time t.
  void add(const Vector3d& normal, const Vector3d& torque, double w, double wr, double t) {
    if (count_ == capacity) flush();
    for (std::size_t i = 0; i < 3; ++i) {
      rows_[i][count_] = normal[static_cast<Eigen::Index>(i)];
      rows_[i + 3][count_] = torque[static_cast<Eigen::Index>(i)];
    }
    weight_[count_] = w;
    residual_[count_] = wr;
    time_[count_] = t;
    ++count_;
  }

  /// Four rows, after as many by fours alone.
  void add(const Four3& normal, const Four3& torque, const Four& w, const Four& wr,
           const Four& t = four(0)) {
    if (count_ == capacity) flush();
    const std::array<const Four*, 6> row = {&normal.x, &normal.y, &normal.z,
                                            &torque.x, &torque.y, &torque.z};
    for (std::size_t i = 0; i < 6; ++i) put(*row[i], &rows_[i][count_]);
    put(w, &weight_[count_]);
    put(wr, &residual_[count_]);
    put(t, &time_[count_]);
    count_ += lanes;
  }

  /// Of rows flushed.
  NormalSums& operator+=(const NormalSums& other) {
    for (std::size_t power = 0; power < products_.size(); ++power) {
      for (std::size_t k = 0; k < products_[power].size(); ++k) {
        products_[power][k] += other.products_[power][k];
      }
    }
    for (std::size_t power = 0; power < residuals_.size(); ++power) {
      for (std::size_t k = 0; k < residuals_[power].size(); ++k) {
        residuals_[power][k] += other.residuals_[power][k];
      }
    }
    return *this;
  }

  void flush() {
    while (count_ % lanes != 0) add(Vector3d::Zero(), Vector3d::Zero(), 0, 0, 0);
    for (std::size_t power = 0; power < (timed_ ? 3 : 1); ++power) {
      for (std::size_t c = 0; c < count_; c += lanes) accumulate(c, power);
      if (!timed_) break;
      for (std::size_t i = 0; i < count_; ++i) {
        weight_[i] *= time_[i];
        residual_[i] *= time_[i];
      }
    }
    count_ = 0;
  }

  /// Sum of t^power w J J^T over all rows flushed; power 0 to 2.
  Matrix6d products(std::size_t power) const {
    Matrix6d a;
    std::size_t k = 0;
    for (Eigen::Index i = 0; i < 6; ++i) {
      for (Eigen::Index j = i; j < 6; ++j) a(i, j) = a(j, i) = products_[power][k++].sum();
    }
    return a;
  }
  /// Sum of t^power w r J; power 0 to 1.
  Vector6d residuals(std::size_t power) const {
    Vector6d b;
    for (std::size_t i = 0; i < 6; ++i) {
      b[static_cast<Eigen::Index>(i)] = residuals_[power][i].sum();
    }
    return b;
  }

 private:
  static constexpr std::size_t lanes = 4;
  using Lane = Eigen::Array<double, static_cast<int>(lanes), 1>;
  using Column = std::array<double, capacity>;

  void accumulate(std::size_t c, std::size_t power) {
    const auto lane = [c](const Column& column) -> Lane {
      return Eigen::Map<const Lane>(column.data() + c);
    };
    const Lane weight = lane(weight_);
    const std::array<Lane, 6> j = {lane(rows_[0]), lane(rows_[1]), lane(rows_[2]),
                                   lane(rows_[3]), lane(rows_[4]), lane(rows_[5])};
    auto& products = products_[power];
    std::size_t k = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const Lane weighted = weight * j[i];
      for (std::size_t n = i; n < 6; ++n) products[k++] += weighted * j[n];
    }
    if (power == 2) return;
    const Lane residual = lane(residual_);
    for (std::size_t i = 0; i < 6; ++i) residuals_[power][i] += residual * j[i];
  }

  bool timed_;
  std::size_t count_ = 0;
  std::array<Column, 6> rows_;
  Column weight_, residual_, time_;
  std::array<std::array<Lane, 21>, 3> products_;
  std::array<std::array<Lane, 6>, 2> residuals_;
};

}  // namespace berth::estimator
