// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/curve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "common/core/nan.h"

namespace berth::report {
namespace {

/// More than the pixels of a chart, so that there is something left to see when it is zoomed.
constexpr std::size_t drawn_columns = 700;

struct Column {
  std::size_t first, lowest, highest, last;

  explicit Column(std::size_t i) : first(i), lowest(i), highest(i), last(i) {}

  void add(std::size_t i, const std::vector<double>& y) {
    if (y[i] < y[lowest]) lowest = i;
    if (y[i] > y[highest]) highest = i;
    last = i;
  }

  void put(std::vector<std::size_t>& kept) const {
    std::array<std::size_t, 4> order = {first, lowest, highest, last};
    std::sort(order.begin(), order.end());
    for (const std::size_t i : order) {
      if (kept.empty() || kept.back() != i) kept.push_back(i);
    }
  }
};

/// Draws in the units of the axes.
class Pen {
 public:
  Pen(const Axis& x, const Axis& y) : x_(x), y_(y) {}

  void to(char command, double x, double y) { path_.add(command, {across(x), down(y)}); }
  void across_to(double x) { path_.add('H', {across(x)}); }
  void down_to(double y) { path_.add('V', {down(y)}); }
  void dot(double x, double y) { path_.dot(across(x), down(y)); }
  void close() { path_.add('z'); }
  svg::Path path() { return std::move(path_); }

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
  svg::Path path_;
};

void draw_line(const Curve& curve, const std::vector<std::size_t>& kept, Pen& pen) {
  bool down = false;
  for (const std::size_t i : kept) {
    const bool good = std::isfinite(curve.y[i]);
    if (good && down && curve.style == Curve::Style::steps) {
      pen.across_to(curve.x[i]);
      pen.down_to(curve.y[i]);
    } else if (good) {
      pen.to(down ? 'L' : 'M', curve.x[i], curve.y[i]);
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
    for (const std::size_t i : worth_drawing(xs, part(curve.y), x.low, x.high, drawn_columns / 2)) {
      pen.to(std::exchange(command, 'L'), xs[i], curve.y[begin + i]);
    }
    auto back = worth_drawing(xs, part(curve.low), x.low, x.high, drawn_columns / 2);
    std::reverse(back.begin(), back.end());
    for (const std::size_t i : back) pen.to('L', xs[i], curve.low[begin + i]);
    pen.close();
    begin = end;
  }
}

bool is_beyond(double value, const Axis& axis) {
  return std::isfinite(value) && (value < axis.low || value > axis.high);
}

}  // namespace

svg::Path path_of(const Curve& curve, const Axis& x, const Axis& y) {
  Pen pen(x, y);
  const auto kept = worth_drawing(curve.x, curve.y, x.low, x.high, drawn_columns);
  switch (curve.style) {
    case Curve::Style::line:
    case Curve::Style::steps:
      draw_line(curve, kept, pen);
      break;
    case Curve::Style::dots:
      for (const std::size_t i : kept) {
        if (!std::isfinite(curve.y[i]) || is_beyond(curve.y[i], y)) continue;
        pen.dot(curve.x[i], curve.y[i]);
      }
      break;
    case Curve::Style::band:
      draw_band(curve, pen, x);
      break;
    case Curve::Style::bars:
      for (std::size_t i = 0; i + 1 < curve.x.size(); ++i) {
        if (!(std::abs(curve.y[i]) > 0)) continue;
        pen.to('M', curve.x[i], y.logarithmic ? y.low : 0.0);
        pen.down_to(curve.y[i]);
        pen.across_to(curve.x[i + 1]);
        pen.down_to(y.logarithmic ? y.low : 0.0);
        pen.close();
      }
      break;
    case Curve::Style::range:
      for (std::size_t i = 0; i < curve.x.size(); ++i) {
        if (!std::isfinite(curve.y[i]) || !std::isfinite(curve.low[i])) continue;
        pen.to('M', curve.x[i], curve.low[i]);
        pen.down_to(curve.y[i]);
      }
      break;
  }
  return pen.path();
}

svg::Path clipped_path_of(const Curve& curve, const Axis& x, const Axis& y, std::size_t& count) {
  if (curve.style != Curve::Style::dots && curve.style != Curve::Style::line) return {};
  Pen pen(x, y);
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    if (!is_beyond(curve.y[i], y)) continue;
    ++count;
    if (count > drawn_columns) continue;
    pen.dot(curve.x[i], curve.y[i] < y.low ? y.low : y.high);
  }
  return pen.path();
}

std::vector<std::size_t> worth_drawing(const std::vector<double>& x, const std::vector<double>& y,
                                       double low, double high, std::size_t columns) {
  std::vector<std::size_t> kept;
  if (x.size() <= 2 * columns || high <= low) {
    kept.resize(x.size());
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    return kept;
  }
  const double scale = static_cast<double>(columns) / (high - low);
  double current = nan;
  std::optional<Column> column;
  const auto close = [&] {
    if (column) column->put(kept);
    column.reset();
  };
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!std::isfinite(y[i])) {
      close();
      // One break is as good as many.
      if (kept.empty() || std::isfinite(y[kept.back()])) kept.push_back(i);
      continue;
    }
    const double here = std::floor((x[i] - low) * scale);
    if (column && here == current) {
      column->add(i, y);
      continue;
    }
    close();
    current = here;
    column.emplace(i);
  }
  close();
  return kept;
}

}  // namespace berth::report
