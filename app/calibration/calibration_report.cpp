// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/calibration_report.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "common/core/svg.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "evaluation/report/axis.h"

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
    text += "a bias of the sensor itself is part of this truth: a tracker would reveal it\n";
  }
  text += c.unobservable.empty() ? "everything could be observed\n"
                                 : "not to be observed, so left as near to the files as can be:\n";
  for (const std::string& direction : c.unobservable) text += "  - " + direction + "\n";
  return text;
}

namespace {

using Residuals = std::vector<testbed::MeasurementResidual>;

constexpr double width = 900;
constexpr double panel_height = 190;
constexpr double top = 64;
constexpr double left = 84;
constexpr double right = 20;
constexpr double title_height = 26;
constexpr double area_height = panel_height - title_height - 24;
constexpr std::size_t max_dots = 1500;  // of one panel: of more, evenly chosen ones
constexpr const char* before_colour = "#7a848d";
constexpr const char* after_colour = "#0072b2";

struct Dot {
  std::string where;
  double size;  // mm or deg
};

/// One kind's distances, before and after.
struct Panel {
  std::string title;
  std::string unit;
  std::vector<Dot> before;
  std::vector<Dot> after;
};

std::vector<Dot> dots_of(const Residuals& residuals, const std::string& kind, bool attitude) {
  std::vector<Dot> dots;
  for (const testbed::MeasurementResidual& r : residuals) {
    if (r.kind != kind || (attitude && !r.attitude)) continue;
    dots.push_back({r.where, attitude ? degrees(*r.attitude) : 1e3 * r.position});
  }
  return dots;
}

std::vector<Panel> panels_of(const testbed::CalibrationSolution& solution) {
  std::vector<std::string> kinds;
  for (const testbed::MeasurementResidual& r : solution.after) {
    if (std::find(kinds.begin(), kinds.end(), r.kind) == kinds.end()) kinds.push_back(r.kind);
  }
  std::vector<Panel> panels;
  for (const std::string& kind : kinds) {
    for (const bool attitude : {false, true}) {
      Panel panel{kind + (attitude ? ", attitude" : ", position"), attitude ? "deg" : "mm",
                  dots_of(solution.before, kind, attitude),
                  dots_of(solution.after, kind, attitude)};
      if (!panel.after.empty()) panels.push_back(std::move(panel));
    }
  }
  return panels;
}

double rms(const std::vector<Dot>& dots) {
  double sum = 0;
  for (const Dot& dot : dots) sum += dot.size * dot.size;
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(dots.size(), 1)));
}

svg::Markup words(double x, double y, const std::string& any, const char* colour = "") {
  return svg::element("text", {{"x", x}, {"y", y}, {"fill", colour}}, svg::text(any));
}

svg::Markup circles(const std::vector<Dot>& dots, const report::Axis& axis, double bottom,
                    const char* colour, const std::string& unit) {
  svg::Markup drawing;
  const std::size_t stride = dots.size() / max_dots + 1;
  for (std::size_t i = 0; i < dots.size(); i += stride) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(dots.size());
    const std::string hover = dots[i].where + ": " + report::brief(dots[i].size, 3) + " " + unit;
    drawing += svg::element("circle",
                            {{"cx", left + share * (width - left - right)},
                             {"cy", bottom - axis.fraction(dots[i].size) * area_height},
                             {"r", 2.5}},
                            svg::element("title", {}, svg::text(hover)));
  }
  return svg::element("g", {{"fill", colour}}, drawing);
}

svg::Markup drawn(const Panel& panel, double y) {
  std::vector<double> values;
  for (const auto* dots : {&panel.before, &panel.after}) {
    for (const Dot& dot : *dots) values.push_back(dot.size);
  }
  const report::Axis axis = report::axis_for(values, true);
  const double bottom = y + panel_height - 24;
  svg::Markup drawing =
      words(left, y + 14,
            panel.title + ": rms " + report::brief(rms(panel.before), 3) + " " + panel.unit +
                " before, " + report::brief(rms(panel.after), 3) + " " + panel.unit + " after (" +
                std::to_string(panel.after.size()) + ")");
  svg::Path lines;
  svg::Markup labels;
  for (const report::Tick& tick : report::ticks(axis, 5)) {
    const double at = bottom - axis.fraction(tick.value) * area_height;
    lines.add('M', {left, at}).add('H', {width - right});
    labels += words(left - 6, at + 4, tick.label + " " + panel.unit);
  }
  drawing += svg::element("path", {{"d", lines}, {"stroke", "#dfe3e7"}}) +
             svg::element("g", {{"text-anchor", "end"}}, labels);
  return drawing + circles(panel.before, axis, bottom, before_colour, panel.unit) +
         circles(panel.after, axis, bottom, after_colour, panel.unit);
}

}  // namespace

std::string residual_picture(const SolvedCalibration& solved) {
  const std::vector<Panel> panels = panels_of(solved.solution);
  const double height = top + panel_height * static_cast<double>(panels.size());
  const testbed::Calibration& c = solved.calibration;
  svg::Markup drawing = svg::element("g", {{"font-size", 15}},
                                     words(left, 24,
                                           "Residuals of the calibration of layout " + c.layout +
                                               ", made " + c.made + ", from " + c.basis));
  drawing += words(left, 44, "\u25CF before: the cell's files", before_colour) +
             words(left + 200, 44, "\u25CF after: calibrated", after_colour);
  double y = top;
  for (const Panel& panel : panels) {
    drawing += drawn(panel, y);
    y += panel_height;
  }
  return svg::document(width, height, "#ffffff", drawing);
}

}  // namespace berth
