// SPDX-License-Identifier: BSD-3-Clause
#include "testbed/calibration/observability.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/text.h"

namespace berth::testbed {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Columns that span the same space, each with a parameter of its own that the others lack.
MatrixXd reduced(MatrixXd basis) {
  std::vector<bool> used(static_cast<std::size_t>(basis.rows()), false);
  for (Index column = 0; column < basis.cols(); ++column) {
    // the largest entry of the columns left
    Index pivot = 0;
    Index from = column;
    double largest = 0;
    for (Index j = column; j < basis.cols(); ++j) {
      for (Index i = 0; i < basis.rows(); ++i) {
        if (used[static_cast<std::size_t>(i)] || std::abs(basis(i, j)) <= largest) continue;
        largest = std::abs(basis(i, j));
        pivot = i;
        from = j;
      }
    }
    if (largest == 0) break;
    used[static_cast<std::size_t>(pivot)] = true;
    basis.col(column).swap(basis.col(from));
    basis.col(column) /= basis(pivot, column);
    for (Index j = 0; j < basis.cols(); ++j) {
      if (j != column) basis.col(j) -= basis(pivot, j) * basis.col(column);
    }
  }
  return basis;
}

bool has(const std::vector<std::string>& names, const std::string& part) {
  return std::any_of(names.begin(), names.end(),
                     [&](const std::string& n) { return n.find(part) != std::string::npos; });
}

std::string text_of(const std::vector<std::string>& names) {
  std::string what;
  for (const std::string arm : {"replica", "sensor"}) {
    if (has(names, arm + ".zero.1") && has(names, "base.")) {
      what = "rotation of the " + arm + " arm's first joint against the base";
    } else if (has(names, arm + ".zero.6") && has(names, arm + ".mount.r")) {
      what = "rotation of the " + arm + " arm's last joint against the mount";
    } else if (has(names, arm + ".d.1") && has(names, "base.")) {
      what = "height of the " + arm + " arm's shoulder against the base";
    }
    if (!what.empty()) break;
  }
  if (what.empty() && has(names, ".time")) what = "all clocks together against the host's";
  const std::string list = berth::joined(names);
  return what.empty() ? list : what + " (" + list + ")";
}

}  // namespace

std::vector<Unobservable> find_unobservable(const MatrixXd& information, const MatrixXd& prior) {
  constexpr double as_good_as_prior = 1;
  constexpr double noticeable = 0.15;  // of the strongest change
  const Eigen::VectorXd sigma = prior.diagonal().cwiseSqrt();
  const MatrixXd scaled = sigma.asDiagonal() * information * sigma.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(scaled);
  Index count = 0;
  while (count < scaled.rows() && solver.eigenvalues()[count] < as_good_as_prior) ++count;
  const MatrixXd basis = reduced(solver.eigenvectors().leftCols(count));
  std::vector<Unobservable> found;
  for (Index column = 0; column < basis.cols(); ++column) {
    std::vector<Index> order(static_cast<std::size_t>(basis.rows()));
    std::iota(order.begin(), order.end(), 0);
    const auto strength = [&](Index i) { return std::abs(basis(i, column)); };
    std::sort(order.begin(), order.end(),
              [&](Index a, Index b) { return strength(a) > strength(b); });
    Unobservable direction;
    for (const Index i : order) {
      if (strength(i) < noticeable * strength(order.front())) break;
      direction.parameters.push_back(calibration_parameters()[static_cast<std::size_t>(i)].name);
    }
    direction.text = text_of(direction.parameters);
    found.push_back(std::move(direction));
  }
  return found;
}

}  // namespace berth::testbed
