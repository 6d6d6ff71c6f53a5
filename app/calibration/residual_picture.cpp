// SPDX-License-Identifier: BSD-3-Clause
#include "app/calibration/residual_picture.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "common/core/valid_text.h"
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

std::string place(double value) { return fixed(value, 1); }

std::string words(double x, double y, const std::string& text, const std::string& more = "") {
  return "<text x=\"" + place(x) + "\" y=\"" + place(y) + "\"" + more + ">" + markup_text(text) +
         "</text>\n";
}

std::string circles(const std::vector<Dot>& dots, const report::Axis& axis, double bottom,
                    const char* colour, const std::string& unit) {
  const double height = panel_height - title_height - 24;
  std::string svg = std::string("<g fill=\"") + colour + "\">\n";
  const std::size_t stride = dots.size() / max_dots + 1;
  for (std::size_t i = 0; i < dots.size(); i += stride) {
    const double share = (static_cast<double>(i) + 0.5) / static_cast<double>(dots.size());
    svg += "<circle cx=\"" + place(left + share * (width - left - right)) + "\" cy=\"" +
           place(bottom - axis.fraction(dots[i].size) * height) + "\" r=\"2.5\"><title>" +
           markup_text(dots[i].where) + ": " + report::brief(dots[i].size, 3) + " " + unit +
           "</title></circle>\n";
  }
  return svg + "</g>\n";
}

std::string drawn(const Panel& panel, double y) {
  std::vector<double> values;
  for (const auto* dots : {&panel.before, &panel.after}) {
    for (const Dot& dot : *dots) values.push_back(dot.size);
  }
  const report::Axis axis = report::axis_for(values, true);
  const double bottom = y + panel_height - 24;
  const double height = panel_height - title_height - 24;
  std::string svg = words(left, y + 14,
                          panel.title + ": rms " + report::brief(rms(panel.before), 3) + " " +
                              panel.unit + " before, " + report::brief(rms(panel.after), 3) + " " +
                              panel.unit + " after (" + std::to_string(panel.after.size()) + ")");
  for (const report::Tick& tick : report::ticks(axis, 5)) {
    const double at = bottom - axis.fraction(tick.value) * height;
    svg += "<path d=\"M" + place(left) + " " + place(at) + "H" + place(width - right) +
           "\" stroke=\"#dfe3e7\"/>\n" +
           words(left - 6, at + 4, tick.label + " " + panel.unit, " text-anchor=\"end\"");
  }
  return svg + circles(panel.before, axis, bottom, before_colour, panel.unit) +
         circles(panel.after, axis, bottom, after_colour, panel.unit);
}

}  // namespace

std::string residual_picture(const SolvedCalibration& solved) {
  const std::vector<Panel> panels = panels_of(solved.solution);
  const double height = top + panel_height * static_cast<double>(panels.size());
  const testbed::Calibration& c = solved.calibration;
  std::string svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + place(width) +
                    " " + place(height) + "\" width=\"" + place(width) + "\" height=\"" +
                    place(height) + "\" font-family=\"system-ui, 'DejaVu Sans', sans-serif\" " +
                    "font-size=\"12\" fill=\"#1b2025\">\n<rect width=\"100%\" height=\"100%\" " +
                    "fill=\"#ffffff\"/>\n";
  svg += words(left, 24,
               "Residuals of the calibration of layout " + c.layout + ", made " + c.made +
                   ", from " + c.basis,
               " font-size=\"15\"");
  svg += words(left, 44, "\u25CF before: the cell's files",
               std::string(" fill=\"") + before_colour + "\"");
  svg += words(left + 200, 44, "\u25CF after: calibrated",
               std::string(" fill=\"") + after_colour + "\"");
  double y = top;
  for (const Panel& panel : panels) {
    svg += drawn(panel, y);
    y += panel_height;
  }
  return svg + "</svg>\n";
}

}  // namespace berth
