// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "testbed/calibration/parameters.h"

namespace berth::testbed {

/// A combined change of parameters without effect on any measurement.
struct Unobservable {
  std::vector<std::string> parameters;  ///< those that change, the strongest first
  std::string text;                     ///< for a person
};

/// Unobservable directions: those in which the measurements have less information than the prior,
/// brought to a form in which each names few parameters.
/// @param information of the measurements alone
/// @param prior covariance
std::vector<Unobservable> find_unobservable(const Eigen::MatrixXd& information,
                                            const Eigen::MatrixXd& prior);

}  // namespace berth::testbed
