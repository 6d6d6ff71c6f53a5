// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/chart.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/text.h"

namespace berth::report {
namespace {

constexpr int x_tick_count = 8;

std::string percent(double fraction) { return fixed(100 * fraction, 2) + "%"; }

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

std::string colour_of(const Curve& curve) { return "c" + std::to_string(curve.colour % 8); }

Html legend_of(const Chart& chart) {
  Html keys;
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const Curve& curve = chart.curves[i];
    if (curve.name.empty()) continue;
    const char* shape = curve.style == Curve::Style::dots ? "dots "
                        : curve.style == Curve::Style::band || curve.style == Curve::Style::bars
                            ? "filled "
                            : "line ";
    const char* dashes = curve.dashed ? " dashed" : "";
    keys += element("span", {{"class", "key"}, {"data-curve", i}},
                    element("i", {{"class", shape + colour_of(curve) + dashes}}, {}) +
                        text(curve.name)) +
            text(" ");
  }
  return keys;
}

/// Something placed along x: `data-x` lets the page's script place it again when zoomed.
Html spans_of(const Chart& chart, const Axis& x) {
  constexpr double room_for_a_name = 0.07;
  Html html;
  int phases = 0;
  for (const Span& span : chart.spans) {
    const double from = x.fraction(span.from);
    const double to = x.fraction(span.to);
    const bool small = std::min(to, 1.0) - std::max(from, 0.0) < room_for_a_name;
    const bool phase = span.kind == Span::Kind::phase;
    const std::string kind = span.kind == Span::Kind::trouble     ? "span trouble"
                             : span.kind == Span::Kind::uncertain ? "span uncertain"
                             : phases % 2 == 0                    ? "span phase even"
                                                                  : "span phase odd";
    if (phase) ++phases;
    html += element("i",
                    {{"class", kind + (small ? " small" : "")},
                     {"data-x", exact(span.from) + " " + exact(span.to)},
                     {"style", style_along(from, to)},
                     {"title", span.name}},
                    phase ? element("b", "", text(span.name)) : Html());
  }
  return html;
}

/// A line across the area, with its name.
Html line_at(const char* kind, const char* side, double fraction, const std::string& name,
             svg::Attribute place = {"data-x", ""}) {
  return element("i",
                 {{"class", kind}, std::move(place), {"style", side + (":" + percent(fraction))}},
                 element("b", "", text(name)));
}

Html ticks_of(const Chart& chart, const Axis& x, const Axis& y) {
  Html html;
  for (const Tick& tick : ticks(y, std::max(2, chart.height_px / 36))) {
    html += line_at("yt", "bottom", y.fraction(tick.value), tick.label);
  }
  // Labels of its own are placed again when zoomed; numbers are made anew.
  for (const auto& [value, label] : chart.x_ticks) {
    html += line_at("xt", "left", x.fraction(value), label, {"data-x", exact(value)});
  }
  if (!chart.x_ticks.empty()) return html;
  for (const Tick& tick : ticks(x, x_tick_count)) {
    html += line_at("xt", "left", x.fraction(tick.value), tick.label);
  }
  return html;
}

Html curves_of(const Chart& chart, const Axis& x, const Axis& y, std::size_t& beyond) {
  constexpr const char* styles[] = {" line", " steps", " dots", " band", " bars", " range"};
  Html paths;
  for (std::size_t i = 0; i < chart.curves.size(); ++i) {
    const Curve& curve = chart.curves[i];
    const std::string colour = colour_of(curve);
    const char* dashes = curve.dashed ? " dashed" : "";
    paths += element("path", {{"data-curve", i},
                              {"class", colour + styles[static_cast<int>(curve.style)] + dashes},
                              {"d", path_of(curve, x, y)}});
    const svg::Path clipped = clipped_path_of(curve, x, y, beyond);
    if (clipped.empty()) continue;
    paths += element("path", {{"data-curve", i}, {"class", colour + " clipped"}, {"d", clipped}});
  }
  return element(
      "svg",
      {{"viewBox", "0 0 1000 1000"}, {"preserveAspectRatio", "none"}, {"aria-hidden", "true"}},
      paths);
}

Html marks_of(const Chart& chart, const Axis& x, const Axis& y) {
  const auto inside = [](double fraction) { return fraction >= 0 && fraction <= 1; };
  Html html;
  for (const Level& level : chart.levels) {
    const double at = y.fraction(level.y);
    if (inside(at)) html += line_at("level", "bottom", at, level.name, {"data-y", exact(level.y)});
  }
  for (const Mark& mark : chart.marks) {
    const double at = x.fraction(mark.x);
    if (!inside(at)) continue;
    html += element("i",
                    {{"class", mark.bad ? "mark bad" : "mark"},
                     {"data-x", exact(mark.x)},
                     {"style", "left:" + percent(at)},
                     {"title", mark.text}},
                    {});
  }
  return html;
}

}  // namespace

Html html_of(const Chart& chart) {
  const Axis x = x_axis_of(chart);
  const Axis y = y_axis_of(chart);
  const bool slanted = chart.slanted_letters > 0;
  std::string style = "--h:" + std::to_string(chart.height_px) + "px";
  if (slanted) style += ";--letters:" + std::to_string(chart.slanted_letters);
  std::size_t beyond = 0;
  const Html curves = curves_of(chart, x, y, beyond);
  Html content =
      element("figcaption", "",
              element("b", "", text(chart.title)) + text(" ") +
                  element("small", "", text(chart.unit)) +
                  element("span", "keys", legend_of(chart))) +
      element("div", "plot",
              element("div", "area",
                      spans_of(chart, x) + ticks_of(chart, x, y) + curves + marks_of(chart, x, y)) +
                  element("span", "xunit", text(chart.x_unit)));
  if (beyond > 0) {
    content +=
        element("p", "note", text(std::to_string(beyond) + " beyond the scale, drawn at its edge"));
  }
  return element("figure",
                 {{"class", slanted ? "chart slanted" : "chart"},
                  {"data-group", chart.group},
                  {"data-xrange", exact(x.low) + " " + exact(x.high)},
                  {"data-yrange", exact(y.low) + " " + exact(y.high)},
                  {"data-log", chart.log_y ? "y" : ""},
                  {"data-fixed-ticks", chart.x_ticks.empty() ? "" : "x"},
                  {"data-unit", chart.unit},
                  {"data-xunit", chart.x_unit},
                  {"style", style}},
                 content) +
         markup("\n");
}

Html grid_of(const std::vector<Chart>& charts) {
  Html figures;
  for (const Chart& chart : charts) figures += html_of(chart);
  return element("div", "grid", figures);
}

}  // namespace berth::report
