// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/summary.h"

#include <cmath>
#include <map>

#include "common/core/table.h"
#include "common/core/text.h"

namespace berth {
namespace {

double shown_scale(Dimension dimension) { return dimension == Dimension::angle ? degrees(1) : 1e3; }

const char* shown_unit(Dimension dimension) {
  return dimension == Dimension::angle ? "deg" : dimension == Dimension::time ? "ms" : "mm";
}

int decimals(Dimension dimension) { return dimension == Dimension::angle ? 4 : 3; }

std::string parameters_text(const SolvedCalibration& solved) {
  const testbed::Calibration& c = solved.calibration;
  Table table{"ll", {"parameter", "unit", "found", "+-", "before +-"}};
  for (int i = 0; i < testbed::calibration_size; ++i) {
    const auto& parameter = testbed::calibration_parameters()[static_cast<std::size_t>(i)];
    const double scale = shown_scale(parameter.dimension);
    const int places = decimals(parameter.dimension);
    table.rows.push_back({parameter.name, shown_unit(parameter.dimension),
                          fixed(scale * c.values[i], places),
                          fixed(scale * std::sqrt(c.covariance(i, i)), places),
                          fixed(scale * std::sqrt(solved.prior(i, i)), places)});
  }
  return text_table(table);
}

std::string residuals_text(const testbed::Calibration& c) {
  Table table{"lll", {"residual", "worst at", "unit", "count", "rms", "worst"}};
  for (const testbed::CalibrationResidual& r : c.residuals) {
    const bool angle = r.kind.find("attitude") != std::string::npos;
    const Dimension dimension = angle ? Dimension::angle : Dimension::length;
    const double scale = shown_scale(dimension);
    table.rows.push_back({r.kind, r.where, shown_unit(dimension), std::to_string(r.count),
                          fixed(scale * r.rms, decimals(dimension)),
                          fixed(scale * r.worst, decimals(dimension))});
  }
  return text_table(table);
}

}  // namespace

std::string summary_of(const SolvedCalibration& solved) {
  const testbed::Calibration& c = solved.calibration;
  std::string text = "calibration of layout '" + c.layout + "' with target '" + c.target +
                     "', made " + c.made + "\nrests on: " + c.basis + " (" +
                     std::to_string(solved.poses) + " poses at rest, " +
                     std::to_string(solved.moving) + " scans in motion";
  if (solved.readings > 0) text += ", " + std::to_string(solved.readings) + " of the tracker";
  text += ")\n";
  for (const std::string& pose : solved.left_out) text += "left out: " + pose + "\n";
  text += "\n" + parameters_text(solved) + "\n" + residuals_text(c) +
          "\n  chi2 per degree of freedom " + fixed(c.chi2_per_dof, 2) + ", " +
          std::to_string(solved.solution.iterations) + " iterations\n";
  text += "\ntruth at these poses is now known to " + fixed(1e3 * solved.truth_position, 2) +
          " mm and " + fixed(degrees(solved.truth_rotation), 3) + " deg (rms)\n";
  if (solved.solution.with_tracker) {
    const Vector6d& bias = solved.solution.scan_bias;
    const auto sigma = [&](int i) { return std::sqrt(solved.solution.scan_bias_covariance(i, i)); };
    text += "against the tracker the sensor is off by";
    for (int i = 0; i < 3; ++i) {
      text += std::string(i == 0   ? " x "
                          : i == 1 ? ", y "
                                   : ", z ") +
              fixed(1e3 * bias[i], 2) + " +- " + fixed(1e3 * sigma(i), 2);
    }
    text += " mm and " + fixed(degrees(bias.tail<3>().norm()), 3) + " deg\n";
  } else {
    text += "a bias of the sensor itself is part of this truth: a tracker would tell it\n";
  }
  text += c.unobservable.empty() ? "everything could be observed\n"
                                 : "not to be observed, so left as near to the files as can be:\n";
  for (const std::string& direction : c.unobservable) text += "  - " + direction + "\n";
  return text;
}

}  // namespace berth
