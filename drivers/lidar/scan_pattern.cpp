// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/scan_pattern.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace berth::lidar {
namespace {

using std::numbers::pi;

/// Cells of at least the spacing along a side.
std::int64_t cells(double side, double spacing) {
  return std::max<std::int64_t>(1, static_cast<std::int64_t>(std::floor(side / spacing + 1e-9)));
}

/// Rows of a raster of so many beams whose cells are about square.
std::int64_t rows_for(const Window& window, std::int64_t count) {
  if (window.spacing > 0 && window.count <= 0) return cells(window.height, window.spacing);
  if (window.height <= 0) return 1;
  if (window.width <= 0) return count;
  const double rows = std::sqrt(static_cast<double>(count) * window.height / window.width);
  return std::clamp<std::int64_t>(std::llround(rows), 1, count);
}

}  // namespace

std::int64_t beam_count(const Window& window) {
  if (window.count > 0) return window.count;
  if (!(window.spacing > 0)) return 0;
  return cells(window.width, window.spacing) * cells(window.height, window.spacing);
}

double beam_spacing(const Window& window) {
  if (window.count <= 0) return window.spacing;
  const double n = window.count;
  if (window.width > 0 && window.height > 0) {
    return std::sqrt(window.width * window.height / n);
  }
  return std::max(window.width, window.height) / n;
}

ScanPattern::ScanPattern(const Window& window) : window_(window), count_(beam_count(window)) {
  const double n = static_cast<double>(count_);
  switch (window.pattern) {
    case Pattern::raster:
      rows_ = rows_for(window, count_);
      break;
    case Pattern::spiral:  // n points along pi * turns, as far apart as the turns: 1 / turns
      turns_ = std::max(1.0, std::sqrt(n / pi));
      break;
    case Pattern::rosette:  // p petals, 2 pi / p apart at the rim, n / p points on each, 2 long
      turns_ = std::max(1.0, std::round((std::sqrt(pi * n) - 1) / 2));
      break;
    case Pattern::lissajous:  // 4 sqrt(2) p long in all, 1 / p between its strands
      turns_ = std::max(1.0, std::round(std::sqrt(n / (4 * std::sqrt(2.0)))));
      break;
  }
}

BeamAngles ScanPattern::beam(std::int64_t i) const {
  BeamAngles unit;
  switch (window_.pattern) {
    case Pattern::raster:
      unit = raster(i);
      break;
    case Pattern::spiral:
      unit = spiral(i);
      break;
    case Pattern::rosette:
      unit = rosette(i);
      break;
    case Pattern::lissajous:
      unit = lissajous(i);
      break;
  }
  return {window_.azimuth + 0.5 * window_.width * unit.azimuth,
          window_.elevation + 0.5 * window_.height * unit.elevation};
}

BeamAngles ScanPattern::raster(std::int64_t i) const {
  // Row r holds the beams [r * n / rows, (r + 1) * n / rows): as even as whole numbers allow.
  std::int64_t row = i * rows_ / count_;
  while ((row + 1) * count_ / rows_ <= i) ++row;
  const std::int64_t first = row * count_ / rows_;
  const std::int64_t in_row = (row + 1) * count_ / rows_ - first;
  const double across =
      (2.0 * static_cast<double>(i - first) + 1) / static_cast<double>(in_row) - 1;
  const double down = (2.0 * static_cast<double>(row) + 1) / static_cast<double>(rows_) - 1;
  return {row % 2 == 0 ? across : -across, -down};
}

BeamAngles ScanPattern::spiral(std::int64_t i) const {
  const double radius = std::sqrt((static_cast<double>(i) + 0.5) / static_cast<double>(count_));
  const double angle = 2 * pi * turns_ * radius;
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

BeamAngles ScanPattern::rosette(std::int64_t i) const {
  const double t = static_cast<double>(i) / static_cast<double>(count_);
  const double out = 2 * pi * turns_ * t;
  const double back = 2 * pi * (turns_ + 1) * t;
  return {0.5 * (std::cos(out) + std::cos(back)), 0.5 * (std::sin(out) - std::sin(back))};
}

BeamAngles ScanPattern::lissajous(std::int64_t i) const {
  const double t = (static_cast<double>(i) + 0.5) / static_cast<double>(count_);
  return {std::cos(2 * pi * turns_ * t), std::sin(2 * pi * (turns_ + 1) * t)};
}

}  // namespace berth::lidar
