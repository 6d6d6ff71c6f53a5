// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>

#include "common/core/config.h"
#include "common/core/file.h"
#include "common/core/sha256.h"
#include "testbed/calibration/calibration.h"

namespace berth::testbed {
namespace {

struct ShownUnit {
  const char* name;
  double scale;  // of one SI unit
};

ShownUnit unit_of(Dimension dimension) {
  if (dimension == Dimension::angle) return {"deg", degrees(1)};
  return {dimension == Dimension::time ? "ms" : "mm", 1e3};
}

std::string quantity(double value, Dimension dimension, int digits = 7) {
  const ShownUnit unit = unit_of(dimension);
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value * unit.scale);
  return std::string(text) + " " + unit.name;
}

std::string list_of(const std::vector<std::string>& lines) {
  if (lines.empty()) return " []\n";
  std::string text = "\n";
  for (const std::string& line : lines) text += "  - " + line + "\n";
  return text;
}

/// A factor of a matrix that may be singular: L L^T of one that differs from it by rounding.
Eigen::MatrixXd factor_of(const Eigen::MatrixXd& covariance) {
  // Scaled to a unit diagonal; what has no variance keeps none.
  const Eigen::Index n = covariance.rows();
  Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  Eigen::MatrixXd scaled = Eigen::MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      if (i != j && sigma[i] > 0 && sigma[j] > 0) {
        scaled(i, j) = covariance(i, j) / (sigma[i] * sigma[j]);
      }
    }
  }
  scaled.diagonal().array() += 1e-12;
  const Eigen::MatrixXd factor = scaled.llt().matrixL();
  return sigma.asDiagonal() * factor;
}

}  // namespace

std::string text_of(const Calibration& c) {
  std::string text =
      "# SPDX-License-Identifier: BSD-3-Clause\n# Made by berth calibrate: by how much the "
      "cell departs from its layout and arm files.\n";
  text += "basis: " + c.basis + "\nmade: " + c.made + "\nlayout: " + c.layout +
          "\ntarget: " + c.target + "\ntarget_hash: " + c.target_hash +
          "\ngeometry_hash: " + c.geometry_hash + "\nsources:" + list_of(c.sources) +
          "\nparameters:\n";
  for (int i = 0; i < calibration_size; ++i) {
    const CalibrationParameter& p = calibration_parameters()[static_cast<std::size_t>(i)];
    text += "  " + p.name + ": {value: " + quantity(c.values[i], p.dimension) +
            ", sigma: " + quantity(std::sqrt(std::max(0.0, c.covariance(i, i))), p.dimension, 4) +
            "}\n";
  }
  text += "\n# Fixed by the prior, because no measurement determines them:\nunobservable:" +
          list_of(c.unobservable) + "\nresiduals:";
  text += c.residuals.empty() ? " []\n" : "\n";
  for (const CalibrationResidual& r : c.residuals) {
    const bool angle = r.kind.find("attitude") != std::string::npos;
    const Dimension dimension = angle ? Dimension::angle : Dimension::length;
    text += "  - {kind: \"" + r.kind + "\", count: " + std::to_string(r.count) +
            ", rms: " + quantity(r.rms, dimension, 4) +
            ", worst: " + quantity(r.worst, dimension, 4) + ", where: \"" + r.where + "\"}\n";
  }
  char number[40];
  std::snprintf(number, sizeof number, "%.4g", c.chi2_per_dof);
  text += std::string("chi2_per_dof: ") + number +
          "\n\n# L of the covariance L L^T, in the order above; m, rad, s:\nfactor:\n";
  const Eigen::MatrixXd factor = factor_of(c.covariance);
  for (int i = 0; i < calibration_size; ++i) {
    text += "  - [";
    for (int j = 0; j <= i; ++j) {
      std::snprintf(number, sizeof number, "%.5g", factor(i, j));
      text += (j == 0 ? "" : ",") + std::string(number);
    }
    text += "]\n";
  }
  return text;
}

void write_calibration(const Calibration& calibration, const std::filesystem::path& file) {
  write_file(file, text_of(calibration));
}

Calibration read_calibration(const std::filesystem::path& file) {
  Config config = Config::load(file);
  Calibration c;
  c.basis = config.text("basis");
  if (c.basis.empty() || c.basis == "nominal") {
    throw config.error("basis", "found '" + c.basis + "', expected what it rests on");
  }
  c.made = config.text("made");
  c.layout = config.text("layout");
  c.target = config.text("target");
  c.target_hash = config.text("target_hash");
  c.geometry_hash = config.text("geometry_hash");
  if (config.has("sources")) c.sources = config.texts("sources");
  Config parameters = config.section("parameters");
  for (int i = 0; i < calibration_size; ++i) {
    const CalibrationParameter& p = calibration_parameters()[static_cast<std::size_t>(i)];
    Config entry = parameters.section(p.name);
    c.values[i] = entry.quantity("value", p.dimension);
    entry.quantity("sigma", p.dimension);
    entry.finish();
  }
  parameters.finish();
  if (config.has("unobservable")) c.unobservable = config.texts("unobservable");
  for (Config entry : config.sections("residuals")) {
    CalibrationResidual r;
    r.kind = entry.text("kind");
    const bool angle = r.kind.find("attitude") != std::string::npos;
    const Dimension dimension = angle ? Dimension::angle : Dimension::length;
    r.count = entry.integer("count");
    r.rms = entry.quantity("rms", dimension);
    r.worst = entry.quantity("worst", dimension);
    r.where = entry.text("where");
    entry.finish();
    c.residuals.push_back(r);
  }
  c.chi2_per_dof = config.number("chi2_per_dof");
  const YamlNode rows = config.raw("factor");
  if (!rows.is_list() || rows.size() != calibration_size) {
    throw config.error("factor", "expected " + std::to_string(calibration_size) + " rows");
  }
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(calibration_size, calibration_size);
  for (int i = 0; i < calibration_size; ++i) {
    const YamlNode& row = rows.items()[static_cast<std::size_t>(i)];
    if (!row.is_list() || row.size() != static_cast<std::size_t>(i) + 1) {
      throw config.error("factor", "row " + std::to_string(i + 1) + ": expected " +
                                       std::to_string(i + 1) + " numbers");
    }
    for (int j = 0; j <= i; ++j) {
      const std::string& text = row.items()[static_cast<std::size_t>(j)].text();
      try {
        factor(i, j) = parse_quantity(text, Dimension::number);
      } catch (const InputError& e) {
        throw config.error("factor", "row " + std::to_string(i + 1) + ": " + e.what());
      }
    }
  }
  config.finish();
  c.covariance = factor * factor.transpose();
  c.hash = sha256(read_file(file));
  return c;
}

}  // namespace berth::testbed
