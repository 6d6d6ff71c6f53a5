// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/acquire/range_image.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace berth::estimator {
namespace {

constexpr double max_turn_cosine = 0.26;  // of 75 degrees
constexpr int max_pixels = 4000000;
/// Beams of one pixel measure the same point: more than these, evenly sampled, are left out to save
/// time.
constexpr std::size_t max_in_pixel = 8;

double normal_density(double error, double sigma) {
  return std::exp(-0.5 * error * error / (sigma * sigma)) / (2.5066282746310002 * sigma);
}

double spacing_of(const Beam& a, const Beam& b) { return (a.direction - b.direction).norm(); }

/// Range of a beam on the line through the returns of two on either side.
double on_line(const Beam& beam, const Beam& one, const Beam& other) {
  const double a = spacing_of(beam, one), c = spacing_of(beam, other);
  return (a + c) / (c / one.range + a / other.range);
}

}  // namespace

RangeImage::RangeImage(const PreprocessedScan& scan, const BeamModel& beam_model)
    : noise_(beam_model) {
  // In integers, whose sum is independent of the order.
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
  rasterise(scan);
  measure_spacing();
  estimate_noise();
  estimate_background();
}

void RangeImage::rasterise(const PreprocessedScan& scan) {
  struct Projected {
    double x, y;
    const Beam* beam;
    int pixel;
  };
  std::vector<Projected> projected;
  double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
  for (const Beam& beam : scan.beams) {
    const double depth = axis_.dot(beam.direction);
    if (depth < max_turn_cosine) continue;
    const Projected p{across_.dot(beam.direction) / depth, down_.dot(beam.direction) / depth, &beam,
                      0};
    left = std::min(left, p.x);
    right = std::max(right, p.x);
    top = std::min(top, p.y);
    bottom = std::max(bottom, p.y);
    projected.push_back(p);
  }
  if (projected.empty()) return;
  const double area = std::max(1e-12, (right - left) * (bottom - top));
  const auto assign_pixels = [&](double spacing, double aspect) {
    spacing_ = std::max({1e-6, spacing, std::sqrt(area / max_pixels)});
    columns_per_unit_ = 1 / (spacing_ * aspect);
    rows_per_unit_ = aspect / spacing_;
    left_ = left - 0.5 / columns_per_unit_;
    top_ = top - 0.5 / rows_per_unit_;
    width_ = static_cast<int>((right - left_) * columns_per_unit_) + 1;
    height_ = static_cast<int>((bottom - top_) * rows_per_unit_) + 1;
    beam_at_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), -1);
    std::size_t filled = 0;
    for (Projected& p : projected) {
      p.pixel = static_cast<int>((p.x - left_) * columns_per_unit_) +
                width_ * static_cast<int>((p.y - top_) * rows_per_unit_);
      int& at = beam_at_[static_cast<std::size_t>(p.pixel)];
      if (at < 0) ++filled;
      at = 0;
    }
    return filled;
  };
  // The aspect ratio of pixels that separates the most beams.
  double spacing = std::sqrt(area / static_cast<double>(projected.size()));
  double aspect = 1;
  for (int pass = 0; pass < 2; ++pass) {
    std::size_t max_filled = 0;
    double best = 1;
    for (const double trial : {1.0, 0.71, 1.41, 0.5, 2.0, 0.35, 2.83, 0.25, 4.0, 0.18, 0.125}) {
      const std::size_t filled = assign_pixels(spacing, trial);
      if (static_cast<double>(filled) <= 1.05 * static_cast<double>(max_filled)) continue;
      max_filled = filled;
      best = trial;
    }
    aspect = best;
    // A scan of several windows is denser than its bounding box implies.
    const double beams_per_pixel =
        static_cast<double>(projected.size()) / static_cast<double>(max_filled);
    if (pass == 1 || beams_per_pixel < 2) break;
    spacing /= std::sqrt(beams_per_pixel);
  }
  solid_angle_ = static_cast<double>(assign_pixels(spacing, aspect)) * spacing_ * spacing_;
  std::sort(projected.begin(), projected.end(), [](const Projected& a, const Projected& b) {
    if (a.pixel != b.pixel) return a.pixel < b.pixel;
    if (a.x != b.x) return a.x < b.x;
    if (a.y != b.y) return a.y < b.y;
    return a.beam->range < b.beam->range;
  });
  std::fill(beam_at_.begin(), beam_at_.end(), -1);
  nearest_ = missed;
  for (std::size_t from = 0, to = 0; from < projected.size(); from = to) {
    while (to < projected.size() && projected[to].pixel == projected[from].pixel) ++to;
    beam_at_[static_cast<std::size_t>(projected[from].pixel)] = static_cast<int>(beams_.size());
    const std::size_t every = 1 + (to - from - 1) / max_in_pixel;
    for (std::size_t i = from; i < to; i += every) {
      beams_.push_back(*projected[i].beam);
      pixel_of_.push_back(projected[i].pixel);
    }
  }
  first_from_.assign(beam_at_.size() + 1, 0);
  for (const int pixel : pixel_of_) ++first_from_[static_cast<std::size_t>(pixel) + 1];
  std::partial_sum(first_from_.begin(), first_from_.end(), first_from_.begin());
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

/// Half the side of the smallest square about a beam's pixel that contains four scanned pixels, as
/// in the corner of a grid.
void RangeImage::measure_spacing() {
  constexpr int scanned_about = 4;
  const int across = width_ + 1;
  std::vector<int> sums(static_cast<std::size_t>(across) * static_cast<std::size_t>(height_ + 1));
  const auto sum = [&](int x, int y) -> int& {  // integral image of scanned pixels
    return sums[static_cast<std::size_t>(x + across * y)];
  };
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      sum(x + 1, y + 1) =
          sum(x, y + 1) + sum(x + 1, y) - sum(x, y) + (beam_at(x + width_ * y) >= 0 ? 1 : 0);
    }
  }
  const int farthest = std::max(width_, height_);
  for (const int pixel : pixel_of_) {
    const int x = pixel % width_;
    const int y = pixel / width_;
    int apart = 1;
    for (; apart < farthest; ++apart) {
      const int left = std::max(0, x - apart), right = std::min(width_, x + apart + 1);
      const int top = std::max(0, y - apart), bottom = std::min(height_, y + apart + 1);
      if (sum(right, bottom) - sum(left, bottom) - sum(right, top) + sum(left, top) >=
          scanned_about) {
        break;
      }
    }
    pixels_apart_.push_back(apart);
  }
}

void RangeImage::spans_of(const Box& box, const Pose& pose, std::vector<Span>& spans) const {
  spans.clear();
  const Pose to_image = Pose{Vector3d::Zero(), Quaterniond(axes())} * pose;
  struct Place {
    float x, y;  // pixels
  };
  std::array<Place, 8> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    Vector3d corner = box.low;
    for (int axis = 0; axis < 3; ++axis) {
      if (i >> axis & 1) corner[axis] = box.high[axis];
    }
    const Vector3d p = to_image * corner;
    if (p.z() < 0.1 * p.norm()) {  // beyond 84 degrees from the mean direction
      spans.push_back({0, beams_.size()});
      return;
    }
    corners[i] = {static_cast<float>((p.x() / p.z() - left_) * columns_per_unit_),
                  static_cast<float>((p.y() / p.z() - top_) * rows_per_unit_)};
  }
  // Extent of the box's edges in each row of pixels.
  static thread_local std::vector<std::array<float, 2>> rows;
  rows.assign(static_cast<std::size_t>(height_), {1e9F, -1e9F});
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t side = 1; side < corners.size(); side *= 2) {
      if ((i & side) != 0) continue;
      const Place& a = corners[i];
      const Place& b = corners[i + side];
      const Place& top = a.y < b.y ? a : b;
      const Place& bottom = a.y < b.y ? b : a;
      const float slope = (bottom.x - top.x) / (bottom.y - top.y);
      const int first = static_cast<int>(std::floor(std::max(0.0F, top.y)));
      const int last =
          static_cast<int>(std::floor(std::min(bottom.y, static_cast<float>(height_ - 1))));
      for (int y = first; y <= last; ++y) {
        const auto above = static_cast<float>(y);
        const float in = above > top.y ? top.x + slope * (above - top.y) : top.x;
        const float out = above + 1 < bottom.y ? top.x + slope * (above + 1 - top.y) : bottom.x;
        auto& [left, right] = rows[static_cast<std::size_t>(y)];
        left = std::min({left, in, out});
        right = std::max({right, in, out});
      }
    }
  }
  constexpr float rounding = 0.01F;
  for (int y = 0; y < height_; ++y) {
    const auto& [left, right] = rows[static_cast<std::size_t>(y)];
    const float from = std::max(0.0F, left - rounding);
    const float to = std::min(static_cast<float>(width_) - 0.5F, right + rounding);
    if (from > to) continue;
    const auto row = static_cast<std::size_t>(width_) * static_cast<std::size_t>(y);
    spans.push_back({first_from_[row + static_cast<std::size_t>(from)],
                     first_from_[row + static_cast<std::size_t>(to) + 1]});
  }
}

/// The next beam in a direction, at most two steps away, or null. Of several in a pixel the nearest
/// in time, between which the sensor has moved least.
const Beam* RangeImage::neighbour(const Beam* beam, int dx, int dy) const {
  if (beam == nullptr) return nullptr;
  const auto at = static_cast<int>(beam - beams_.data());
  int x = pixel_of(at) % width_;
  int y = pixel_of(at) / width_;
  for (int step = 0; step < 2 * pixels_apart(at); ++step) {
    x += dx;
    y += dy;
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return nullptr;
    const auto [from, to] = beams_at(x + width_ * y);
    if (from == to) continue;
    return &*std::min_element(
        beams_.begin() + static_cast<std::ptrdiff_t>(from),
        beams_.begin() + static_cast<std::ptrdiff_t>(to), [beam](const Beam& a, const Beam& b) {
          return std::abs(a.utime - beam->utime) < std::abs(b.utime - beam->utime);
        });
  }
  return nullptr;
}

/// Angle of incidence, rad, by the nearer neighbour's range along each axis, noise subtracted.
double RangeImage::incidence(const Beam& beam) const {
  double tangents = 0;  // squared
  for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{0, 1}}) {
    double squared = std::numeric_limits<double>::infinity();
    for (const int sign : {1, -1}) {
      const Beam* n = neighbour(&beam, sign * dx, sign * dy);
      if (n == nullptr || !n->hit()) continue;
      const double off = n->range - beam.range;
      squared = std::min(squared, (off * off - 2 * noise_.range_sigma_m * noise_.range_sigma_m) /
                                      std::pow(spacing_of(beam, *n) * beam.range, 2));
    }
    if (std::isfinite(squared)) tangents += std::max(0.0, squared);
  }
  return std::atan(std::sqrt(tangents));
}

/// Expectation maximisation: a beam between two others is on their line with Gaussian noise, or, at
/// edges, uniform.
void RangeImage::estimate_noise() {
  constexpr double prior_beams = 20;  // weight of the specification
  constexpr int steps = 20;
  std::vector<double> errors;  // in sigmas
  for (const Beam& beam : beams_) {
    for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{0, 1}}) {
      const Beam* one = neighbour(&beam, dx, dy);
      const Beam* other = neighbour(&beam, -dx, -dy);
      if (!beam.hit() || one == nullptr || other == nullptr || !one->hit() || !other->hit()) {
        continue;
      }
      const double share =
          spacing_of(beam, *one) / (spacing_of(beam, *one) + spacing_of(beam, *other));
      const double of_line = 1 + share * share + (1 - share) * (1 - share);
      errors.push_back((beam.range - on_line(beam, *one, *other)) /
                       (noise_.range_sigma_m * std::sqrt(of_line)));
    }
  }
  const double anywhere = noise_.range_sigma_m / depth();
  double on_lines = 0.5;
  for (int step = 0; step < steps; ++step) {
    double count = prior_beams, sum = prior_beams;
    for (const double e : errors) {
      const double on = on_lines * normal_density(e, noise_scale_);
      const double p = on / (on + (1 - on_lines) * anywhere);
      count += p;
      sum += p * e * e;
    }
    on_lines = count / (static_cast<double>(errors.size()) + 2 * prior_beams);
    const double before = noise_scale_;
    noise_scale_ = std::max(1.0, std::sqrt(sum / count));
    if (std::abs(noise_scale_ - before) < 0.01) break;
  }
  noise_.range_sigma_m *= noise_scale_;
  noise_.azimuth_sigma_rad *= noise_scale_;
  noise_.elevation_sigma_rad *= noise_scale_;
}

void RangeImage::estimate_background() {
  enum : std::size_t { plane, line, beyond, copy, anywhere, predictors };
  constexpr double no_prediction = -1;
  constexpr double as_likely = 1.0 / static_cast<double>(predictors);
  constexpr double prior_beams = 20;
  constexpr int steps = 8;
  const std::array<std::array<int, 2>, 4> ways = {{{1, 0}, {0, 1}, {1, 1}, {1, -1}}};
  std::vector<std::array<double, predictors>> densities(beams_.size());
  std::vector<double> returns(beams_.size());
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const Beam& beam = beams_[b];
    const double z = beam.range;
    const double sigma =
        beam.hit() ? std::sqrt(noise_.range_variance(z, std::max(0.6, incidence(beam)))) : 0;
    double seen = 0.5, neighbours = 1, lines = 0, on_lines = 0;
    std::array<double, predictors> sum{}, count{};
    const auto add = [&](std::size_t predictor, double range, double width) {
      if (range <= 0) return;
      sum[predictor] += normal_density(z - range, width);
      ++count[predictor];
    };
    for (std::size_t w = 0; w < ways.size(); ++w) {
      std::array<const Beam*, 2> next{};  // that returned
      for (std::size_t side = 0; side < 2; ++side) {
        const int sign = side == 0 ? 1 : -1;
        const Beam* n = neighbour(&beam, sign * ways[w][0], sign * ways[w][1]);
        if (n == nullptr) continue;
        ++neighbours;
        if (!n->hit()) continue;
        ++seen;
        next[side] = n;
        if (!beam.hit() || w >= 2) continue;
        add(copy, n->range, 1.4 * sigma + 0.4 * spacing_of(beam, *n) * z);
        const Beam* s = neighbour(n, sign * ways[w][0], sign * ways[w][1]);
        if (s == nullptr || !s->hit()) continue;
        const double a = spacing_of(beam, *n), c = spacing_of(beam, *s);
        if (c > a) add(beyond, (c - a) / (c / n->range - a / s->range), 2.5 * sigma + 0.005);
      }
      if (!beam.hit() || next[0] == nullptr || next[1] == nullptr) continue;
      const double range = on_line(beam, *next[0], *next[1]);
      if (w < 2) add(line, range, 1.25 * sigma + 0.002);
      on_lines += range;
      ++lines;
    }
    if (lines >= 3) add(plane, on_lines / lines, std::sqrt(1 + 0.5 / lines) * sigma + 0.002);
    returns[b] = seen / neighbours;
    for (std::size_t k = 0; k < predictors; ++k) {
      densities[b][k] = count[k] > 0 ? sum[k] / count[k] : no_prediction;
    }
    densities[b][anywhere] = 1 / depth();
  }
  // Weights of the predictors by expectation maximisation.
  std::array<double, predictors> share;
  share.fill(as_likely);
  const auto mixed = [&](const std::array<double, predictors>& of_beam) {
    double sum = 0, known = 0;
    for (std::size_t k = 0; k < predictors; ++k) {
      if (of_beam[k] == no_prediction) continue;
      sum += share[k] * of_beam[k];
      known += share[k];
    }
    return std::pair(sum, known);
  };
  for (int step = 0; step < steps; ++step) {
    std::array<double, predictors> right, all;
    right.fill(prior_beams * as_likely);
    all.fill(prior_beams);
    for (std::size_t b = 0; b < beams_.size(); ++b) {
      if (!beams_[b].hit()) continue;
      const double sum = mixed(densities[b]).first;
      for (std::size_t k = 0; k < predictors; ++k) {
        if (densities[b][k] == no_prediction) continue;
        right[k] += share[k] * densities[b][k] / sum;
        ++all[k];
      }
    }
    for (std::size_t k = 0; k < predictors; ++k) share[k] = right[k] / all[k];
  }
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const auto [sum, known] = mixed(densities[b]);
    log_background_.push_back(
        std::log(beams_[b].hit() ? returns[b] * sum / known : 1 - returns[b]));
  }
}

}  // namespace berth::estimator
