// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/range_image.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace berth::estimator {
namespace {

constexpr double max_turn_cosine = 0.26;  // of 75 degrees
constexpr int max_pixels = 4000000;

/// Shares of what neighbours say, where they say it: a line between two, a line beyond two, a copy
/// of one; the rest is anywhere.
constexpr double between = 0.5;
constexpr double beyond = 0.2;
constexpr double copied = 0.15;

double normal_density(double error, double sigma) {
  return std::exp(-0.5 * error * error / (sigma * sigma)) / (2.5066282746310002 * sigma);
}

}  // namespace

RangeImage::RangeImage(const CleanScan& scan, const BeamModel& beam_model) {
  // In whole numbers, whose sum does not depend on their order.
  std::array<std::int64_t, 3> sum{};
  for (const Vector3d& p : scan.points) {
    const Vector3d direction = p.normalized();
    for (int i = 0; i < 3; ++i) {
      sum[static_cast<std::size_t>(i)] += std::llround(std::ldexp(direction[i], 32));
    }
  }
  const Vector3d mean(static_cast<double>(sum[0]), static_cast<double>(sum[1]),
                      static_cast<double>(sum[2]));
  if (mean.norm() > 0) axis_ = mean.normalized();
  across_ = axis_.unitOrthogonal();
  // The image's sides are those of scanners that sweep azimuth and elevation.
  if (const Vector3d side = Vector3d::UnitY().cross(axis_); side.norm() > 0.1) {
    across_ = side.normalized();
  }
  down_ = axis_.cross(across_);
  place(scan);
  weigh_background(beam_model);
}

void RangeImage::place(const CleanScan& scan) {
  struct Placed {
    double x, y;
    const Beam* beam;
    int pixel;
  };
  std::vector<Placed> placed;
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const Beam& beam : scan.beams) {
    const double depth = axis_.dot(beam.direction);
    if (depth < max_turn_cosine) continue;
    const Placed p{across_.dot(beam.direction) / depth, down_.dot(beam.direction) / depth, &beam,
                   0};
    left = std::min(left, p.x);
    right = std::max(right, p.x);
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
    placed.push_back(p);
  }
  if (placed.empty()) return;
  const double area = std::max(1e-12, (right - left) * (bottom - top));
  const auto lay = [&](double spacing, double aspect) {
    spacing_ = std::max({1e-6, spacing, std::sqrt(area / max_pixels)});
    columns_per_unit_ = 1 / (spacing_ * aspect);
    rows_per_unit_ = aspect / spacing_;
    left_ = left - 0.5 / columns_per_unit_;
    top_ = top - 0.5 / rows_per_unit_;
    width_ = static_cast<int>((right - left_) * columns_per_unit_) + 1;
    height_ = static_cast<int>((bottom - top_) * rows_per_unit_) + 1;
    beam_at_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), -1);
    std::size_t filled = 0;
    for (Placed& p : placed) {
      p.pixel = static_cast<int>((p.x - left_) * columns_per_unit_) +
                width_ * static_cast<int>((p.y - top_) * rows_per_unit_);
      int& at = beam_at_[static_cast<std::size_t>(p.pixel)];
      if (at < 0) ++filled;
      at = 0;
    }
    return filled;
  };
  // Pixels as high as rows are apart, whatever the scanner: so that beams share as few as can be.
  double spacing = std::sqrt(area / static_cast<double>(placed.size()));
  double aspect = 1;
  for (int pass = 0; pass < 2; ++pass) {
    std::size_t most = 0;
    double best = 1;
    for (const double tried : {1.0, 0.71, 1.41, 0.5, 2.0, 0.35, 2.83, 0.25, 4.0, 0.18, 0.125}) {
      const std::size_t filled = lay(spacing, tried);
      if (static_cast<double>(filled) <= 1.05 * static_cast<double>(most)) continue;
      most = filled;
      best = tried;
    }
    aspect = best;
    // A scan of several windows is denser than its outline says.
    const double crowd = static_cast<double>(placed.size()) / static_cast<double>(most);
    if (pass == 1 || crowd < 2) break;
    spacing /= std::sqrt(crowd);
  }
  solid_angle_ = static_cast<double>(lay(spacing, aspect)) * spacing_ * spacing_;
  std::sort(placed.begin(), placed.end(), [](const Placed& a, const Placed& b) {
    if (a.pixel != b.pixel) return a.pixel < b.pixel;
    if (a.x != b.x) return a.x < b.x;
    if (a.y != b.y) return a.y < b.y;
    return a.beam->range < b.beam->range;
  });
  std::fill(beam_at_.begin(), beam_at_.end(), -1);
  nearest_ = missed;
  for (const Placed& p : placed) {
    int& at = beam_at_[static_cast<std::size_t>(p.pixel)];
    if (at < 0) at = static_cast<int>(beams_.size());
    beams_.push_back(*p.beam);
    pixel_of_.push_back(p.pixel);
  }
  for (const Vector3d& p : scan.points) {
    nearest_ = std::min(nearest_, p.norm());
    farthest_ = std::max(farthest_, p.norm());
  }
  nearest_about_.assign(beam_at_.size(), std::numeric_limits<float>::infinity());
  farthest_about_.assign(beam_at_.size(), 0);
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const int x = pixel_of_[b] % width_;
    const int y = pixel_of_[b] / width_;
    const auto range = static_cast<float>(beams_[b].range);
    for (int j = std::max(0, y - 1); j <= std::min(height_ - 1, y + 1); ++j) {
      for (int i = std::max(0, x - 1); i <= std::min(width_ - 1, x + 1); ++i) {
        const auto at = static_cast<std::size_t>(i + width_ * j);
        nearest_about_[at] = std::min(nearest_about_[at], range);
        farthest_about_[at] = std::max(farthest_about_[at], range);
      }
    }
  }
}

/// The next beam in a direction, across at most one pixel without a beam.
int RangeImage::neighbour(int beam, int dx, int dy) const {
  if (beam < 0) return -1;
  int x = pixel_of(beam) % width_;
  int y = pixel_of(beam) / width_;
  for (int step = 0; step < 2; ++step) {
    x += dx;
    y += dy;
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return -1;
    if (const int found = beam_at(x + width_ * y); found >= 0) return found;
  }
  return -1;
}

void RangeImage::weigh_background(const BeamModel& beam_model) {
  const double depth = std::max(1.0, farthest_ - nearest_);
  log_background_.resize(beams_.size());
  const std::array<std::array<int, 2>, 4> ways = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const Beam& beam = beams_[b];
    double seen = 0.5, neighbours = 1;
    std::array<double, 3> density{}, count{};
    for (std::size_t w = 0; w < ways.size(); ++w) {
      std::array<const Beam*, 2> next{}, second{};
      for (std::size_t side = 0; side < 2; ++side) {
        const int sign = side == 0 ? 1 : -1;
        const int n = neighbour(static_cast<int>(b), sign * ways[w][0], sign * ways[w][1]);
        const int s = neighbour(n, sign * ways[w][0], sign * ways[w][1]);
        if (n < 0) continue;
        ++neighbours;
        if (!beams_[static_cast<std::size_t>(n)].hit()) continue;
        ++seen;
        next[side] = &beams_[static_cast<std::size_t>(n)];
        if (s >= 0 && beams_[static_cast<std::size_t>(s)].hit()) {
          second[side] = &beams_[static_cast<std::size_t>(s)];
        }
      }
      if (!beam.hit() || w >= 2) continue;
      const double z = beam.range;
      const double sigma = std::sqrt(beam_model.range_variance(z, 0.6));
      const auto add = [&](std::size_t kind, double inverse, double width) {
        if (inverse <= 0) return;
        density[kind] += normal_density(z - 1 / inverse, width);
        ++count[kind];
      };
      const auto apart = [&beam](const Beam* other) {
        return (other->direction - beam.direction).norm();
      };
      if (next[0] != nullptr && next[1] != nullptr) {
        const double a = apart(next[0]), c = apart(next[1]);
        add(0, (c / next[0]->range + a / next[1]->range) / (a + c), 1.25 * sigma + 0.002);
      }
      for (std::size_t side = 0; side < 2; ++side) {
        if (next[side] == nullptr) continue;
        add(2, 1 / next[side]->range, 1.4 * sigma + 0.4 * apart(next[side]) * z);
        if (second[side] == nullptr) continue;
        const double a = apart(next[side]), c = apart(second[side]);
        if (c <= a) continue;
        add(1, (c / next[side]->range - a / second[side]->range) / (c - a), 2.5 * sigma + 0.005);
      }
    }
    const double returns = seen / neighbours;
    if (!beam.hit()) {
      log_background_[b] = std::log(1 - returns);
      continue;
    }
    double sum = 0, known = 0;
    const std::array<double, 3> shares = {between, beyond, copied};
    for (std::size_t k = 0; k < 3; ++k) {
      if (count[k] == 0) continue;
      sum += shares[k] * density[k] / count[k];
      known += shares[k];
    }
    log_background_[b] = std::log(returns * (sum + (1 - known) / depth));
  }
}

}  // namespace berth::estimator
