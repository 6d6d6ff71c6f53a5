// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/residual_picture.h"

#include <algorithm>
#include <cmath>

#include "common/core/svg.h"
#include "evaluation/report/axis.h"

namespace berth {
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
