// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/curve_path.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "evaluation/report/decimate.h"

namespace berth::report {
namespace {

/// More than the pixels of a chart, so that there is something left to see when it is zoomed.
constexpr std::size_t columns = 700;

void put_number(std::string& path, double value) {
  char text[32];
  const int length = std::snprintf(text, sizeof text, "%.1f", value);
  const bool whole = text[length - 1] == '0';
  path.append(text, static_cast<std::size_t>(whole ? length - 2 : length));
}

class Pen {
 public:
  Pen(const Axis& x, const Axis& y) : x_(x), y_(y) {}

  void put(char command, double x, double y) {
    path_ += command;
    put_number(path_, across(x));
    path_ += ' ';
    put_number(path_, down(y));
  }
  void put(char command, double x_or_y) {
    path_ += command;
    put_number(path_, command == 'V' ? down(x_or_y) : across(x_or_y));
  }
  void add(const char* text) { path_ += text; }
  std::string path() { return std::move(path_); }

 private:
  // Far outside is as good as very far outside, and shorter.
  static double bounded(double v) { return std::clamp(v, -9 * canvas, 9 * canvas); }
  double across(double x) const { return bounded(canvas * x_.fraction(x)); }
  double down(double y) const {
    if (y_.logarithmic && y <= 0) return 2 * canvas;
    return bounded(canvas * (1 - y_.fraction(y)));
  }

  const Axis& x_;
  const Axis& y_;
  std::string path_;
};

void draw_line(const Curve& curve, const std::vector<std::size_t>& kept, Pen& pen) {
  bool down = false;
  for (const std::size_t i : kept) {
    const bool good = std::isfinite(curve.y[i]);
    if (good && down && curve.style == Curve::Style::steps) {
      pen.put('H', curve.x[i]);
      pen.put('V', curve.y[i]);
    } else if (good) {
      pen.put(down ? 'L' : 'M', curve.x[i], curve.y[i]);
    }
    down = good;
  }
}

void draw_band(const Curve& curve, Pen& pen, const Axis& x) {
  const auto good = [&](std::size_t i) {
    return std::isfinite(curve.y[i]) && std::isfinite(curve.low[i]);
  };
  for (std::size_t begin = 0; begin < curve.x.size();) {
    std::size_t end = begin;
    while (end < curve.x.size() && good(end)) ++end;
    if (end == begin) {
      ++begin;
      continue;
    }
    const auto part = [&](const std::vector<double>& v) {
      return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(begin),
                                 v.begin() + static_cast<std::ptrdiff_t>(end));
    };
    const auto xs = part(curve.x);
    char command = 'M';
    for (const std::size_t i : worth_drawing(xs, part(curve.y), x.low, x.high, columns / 2)) {
      pen.put(std::exchange(command, 'L'), xs[i], curve.y[begin + i]);
    }
    auto back = worth_drawing(xs, part(curve.low), x.low, x.high, columns / 2);
    std::reverse(back.begin(), back.end());
    for (const std::size_t i : back) pen.put('L', xs[i], curve.low[begin + i]);
    pen.add("z");
    begin = end;
  }
}

bool is_beyond(double value, const Axis& axis) {
  return std::isfinite(value) && (value < axis.low || value > axis.high);
}

}  // namespace

std::string path_of(const Curve& curve, const Axis& x, const Axis& y) {
  Pen pen(x, y);
  const auto kept = worth_drawing(curve.x, curve.y, x.low, x.high, columns);
  switch (curve.style) {
    case Curve::Style::line:
    case Curve::Style::steps:
      draw_line(curve, kept, pen);
      break;
    case Curve::Style::dots:
      for (const std::size_t i : kept) {
        if (!std::isfinite(curve.y[i]) || is_beyond(curve.y[i], y)) continue;
        pen.put('M', curve.x[i], curve.y[i]);
        pen.add("h0");  // with round ends a line without length is a dot, however it is stretched
      }
      break;
    case Curve::Style::band:
      draw_band(curve, pen, x);
      break;
    case Curve::Style::bars:
      for (std::size_t i = 0; i + 1 < curve.x.size(); ++i) {
        if (!(std::abs(curve.y[i]) > 0)) continue;
        pen.put('M', curve.x[i], y.logarithmic ? y.low : 0.0);
        pen.put('V', curve.y[i]);
        pen.put('H', curve.x[i + 1]);
        pen.put('V', y.logarithmic ? y.low : 0.0);
        pen.add("z");
      }
      break;
    case Curve::Style::range:
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        if (!std::isfinite(curve.y[i]) || !std::isfinite(curve.low[i])) continue;
        pen.put('M', curve.x[i], curve.low[i]);
        pen.put('V', curve.y[i]);
      }
      break;
  }
  return pen.path();
}

std::string clipped_path_of(const Curve& curve, const Axis& x, const Axis& y, std::size_t& count) {
  if (curve.style != Curve::Style::dots && curve.style != Curve::Style::line) return {};
  Pen pen(x, y);
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (!is_beyond(curve.y[i], y)) continue;
    ++count;
    if (count > columns) continue;
    pen.put('M', curve.x[i], curve.y[i] < y.low ? y.low : y.high);
    pen.add("h0");
  }
  return pen.path();
}

}  // namespace berth::report
