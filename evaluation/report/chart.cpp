// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/chart.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "evaluation/report/axis.h"
#include "evaluation/report/curve_path.h"

namespace berth::report {
namespace {

constexpr int x_tick_count = 8;

std::string percent(double fraction) {
  char out[32];
  std::snprintf(out, sizeof out, "%.2f%%", 100 * fraction);
  return out;
}

std::string exact(double value) {
  char out[40];
  std::snprintf(out, sizeof out, "%.9g", value);
  return out;
}

Axis x_axis_of(const Chart& chart) {
  if (chart.x_range) return {(*chart.x_range)[0], (*chart.x_range)[1], false};
  Axis axis{INFINITY, -INFINITY, false};
  for (const Curve& curve : chart.curves) {
    for (const double x : curve.x) {
      axis.low = std::min(axis.low, x);
      axis.high = std::max(axis.high, x);
    }
  }
  if (!(axis.low <= axis.high)) return {0, 1, false};
  if (axis.low == axis.high) return {axis.low - 0.5, axis.high + 0.5, false};
  return axis;
}

Axis y_axis_of(const Chart& chart) {
  if (chart.y_range) return {(*chart.y_range)[0], (*chart.y_range)[1], chart.log_y};
  std::vector<double> values;
  for (const Curve& curve : chart.curves) {
    values.insert(values.end(), curve.y.begin(), curve.y.end());
    values.insert(values.end(), curve.low.begin(), curve.low.end());
    if (curve.style == Curve::Style::bars) values.push_back(0);
  }
  for (const Level& level : chart.levels) values.push_back(level.y);
  Axis axis = chart.clip_extremes ? axis_without_extremes(std::move(values), chart.log_y)
                                  : axis_for(values, chart.log_y);
  const double missing = chart.min_span - (axis.high - axis.low);
  if (missing > 0 && !chart.log_y) {
    axis.low -= missing / 2;
    axis.high += missing / 2;
  }
  return axis;
}

Html legend_of(const Chart& chart) {
  Html keys;
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const Curve& curve = chart.curves[i];
    if (curve.name.empty()) continue;
    const char* shape = curve.style == Curve::Style::dots ? "dots"
                        : curve.style == Curve::Style::band || curve.style == Curve::Style::bars
                            ? "filled"
                            : "line";
    keys += markup("<span class=\"key\" data-curve=\"" + std::to_string(i) + "\"><i class=\"" +
                   shape + " c" + std::to_string(curve.colour % 8) +
                   (curve.dashed ? " dashed" : "") + "\"></i>") +
            text(curve.name) + markup("</span> ");
  }
  return keys;
}

/// Something placed along x: `data-x` lets the page's script place it again when zoomed.
Html spans_of(const Chart& chart, const Axis& x) {
  constexpr double room_for_a_name = 0.07;
  Html html;
  int phases = 0;
  for (const Span& span : chart.spans) {
    const double from = std::clamp(x.fraction(span.from), 0.0, 1.0);
    const double to = std::clamp(x.fraction(span.to), 0.0, 1.0);
    const bool phase = span.kind == Span::Kind::phase;
    const char* kind = span.kind == Span::Kind::trouble ? "trouble"
                       : span.kind == Span::Kind::doubt ? "doubt"
                       : phases % 2 == 0                ? "phase even"
                                                        : "phase odd";
    if (phase) ++phases;
    html += markup(std::string("<i class=\"span ") + kind +
                   (to - from < room_for_a_name ? " small" : "") + "\" data-x=\"" +
                   exact(span.from) + " " + exact(span.to) + "\" style=\"left:" + percent(from) +
                   ";width:" + percent(to - from) + "\" title=\"") +
            text(span.name) + markup("\">") + (phase ? element("b", "", text(span.name)) : Html()) +
            markup("</i>");
  }
  return html;
}

Html ticks_of(const Chart& chart, const Axis& x, const Axis& y) {
  Html html;
  for (const Tick& tick : ticks(y, std::max(2, chart.height_px / 36))) {
    html += markup("<i class=\"yt\" style=\"bottom:" + percent(y.fraction(tick.value)) + "\"><b>") +
            text(tick.label) + markup("</b></i>");
  }
  std::vector<Tick> along;
  if (chart.x_ticks.empty()) {
    along = ticks(x, x_tick_count);
  } else {
    for (const auto& [value, label] : chart.x_ticks) along.push_back({value, label});
  }
  for (const Tick& tick : along) {
    // Labels of its own are placed again when zoomed; numbers are made anew.
    html += markup("<i class=\"xt\"" +
                   (chart.x_ticks.empty() ? "" : " data-x=\"" + exact(tick.value) + "\"") +
                   " style=\"left:" + percent(x.fraction(tick.value)) + "\"><b>") +
            text(tick.label) + markup("</b></i>");
  }
  return html;
}

Html curves_of(const Chart& chart, const Axis& x, const Axis& y, std::size_t& beyond) {
  constexpr const char* styles[] = {"line", "steps", "dots", "band", "bars", "range"};
  std::string svg =
      "<svg viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\" aria-hidden=\"true\">";
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const Curve& curve = chart.curves[i];
    const std::string colour = "c" + std::to_string(curve.colour % 8);
    svg += "<path data-curve=\"" + std::to_string(i) + "\" class=\"" + colour + " " +
           styles[static_cast<int>(curve.style)] + (curve.dashed ? " dashed" : "") + "\" d=\"" +
           path_of(curve, x, y) + "\"/>";
    const std::string clipped = clipped_path_of(curve, x, y, beyond);
    if (!clipped.empty()) {
      svg += "<path data-curve=\"" + std::to_string(i) + "\" class=\"" + colour +
             " clipped\" d=\"" + clipped + "\"/>";
    }
  }
  return markup(svg + "</svg>");
}

Html marks_of(const Chart& chart, const Axis& x, const Axis& y) {
  Html html;
  for (const Level& level : chart.levels) {
    const double at = y.fraction(level.y);
    if (!(at >= 0 && at <= 1)) continue;
    html += markup("<i class=\"level\" data-y=\"" + exact(level.y) +
                   "\" style=\"bottom:" + percent(at) + "\"><b>") +
            text(level.name) + markup("</b></i>");
  }
  for (const Mark& mark : chart.marks) {
    const double at = x.fraction(mark.x);
    if (!(at >= 0 && at <= 1)) continue;
    html += markup(std::string("<i class=\"mark") + (mark.bad ? " bad" : "") + "\" data-x=\"" +
                   exact(mark.x) + "\" style=\"left:" + percent(at) + "\" title=\"") +
            text(mark.text) + markup("\"></i>");
  }
  return html;
}

}  // namespace

Html html_of(const Chart& chart) {
  const Axis x = x_axis_of(chart);
  const Axis y = y_axis_of(chart);
  std::size_t beyond = 0;
  const Html curves = curves_of(chart, x, y, beyond);
  Html html =
      markup("<figure class=\"chart\" data-group=\"") + text(chart.group) +
      markup("\" data-xrange=\"" + exact(x.low) + " " + exact(x.high) + "\" data-yrange=\"" +
             exact(y.low) + " " + exact(y.high) + "\"" + (chart.log_y ? " data-log" : "") +
             (chart.x_ticks.empty() ? "" : " data-fixed-ticks") + " data-unit=\"") +
      text(chart.unit) + markup("\" data-xunit=\"") + text(chart.x_unit) +
      markup("\" style=\"--h:" + std::to_string(chart.height_px) + "px\">\n<figcaption><b>") +
      text(chart.title) + markup("</b> <small>") + text(chart.unit) +
      markup("</small><span class=\"keys\">") + legend_of(chart) +
      markup("</span></figcaption>\n<div class=\"plot\"><div class=\"area\">") +
      spans_of(chart, x) + ticks_of(chart, x, y) + curves + marks_of(chart, x, y) +
      markup("</div><span class=\"xunit\">") + text(chart.x_unit) + markup("</span></div>");
  if (beyond > 0) {
    html +=
        element("p", "note", text(std::to_string(beyond) + " beyond the scale, drawn at its edge"));
  }
  return html + markup("</figure>\n");
}

Html grid_of(const std::vector<Chart>& charts) {
  Html html = markup("<div class=\"grid\">\n");
  for (const Chart& chart : charts) html += html_of(chart);
  return html + markup("</div>\n");
}

}  // namespace berth::report
