// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/axis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/core/text.h"

namespace berth::report {
namespace {

/// 1, 2 or 5 times a power of ten, not below the value.
double round_step(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= value * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

void keep_usable(std::vector<double>& values, bool logarithmic) {
  const auto bad = [logarithmic](double v) { return !std::isfinite(v) || (logarithmic && v <= 0); };
  values.erase(std::remove_if(values.begin(), values.end(), bad), values.end());
}

Axis around(double low, double high, bool logarithmic) {
  if (logarithmic) {
    const double low_power = std::floor(std::log10(low) + 0.05);
    const double high_power = std::max(low_power + 1, std::ceil(std::log10(high) - 0.05));
    return {std::pow(10, low_power), std::pow(10, high_power), true};
  }
  double air = 0.06 * (high - low);
  const double size = std::max(std::abs(low), std::abs(high));
  // Differences of rounding alone are one value: no axis is that fine.
  if (air <= 1e-9 * size) air = size == 0 ? 1 : 0.1 * size;
  // Much of an axis that begins just above zero is better begun at zero.
  const double start = low >= 0 && low < 0.3 * high ? 0 : low - air;
  return {start, high + air, false};
}

std::vector<Tick> multiples(const Axis& axis, double step) {
  std::vector<Tick> list;
  const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
  for (double i = std::ceil(axis.low / step - 1e-9); i * step <= axis.high + 1e-9 * step; ++i) {
    list.push_back({i * step, i == 0 ? "0" : fixed(i * step, decimals)});
  }
  return list;
}

}  // namespace

double Axis::fraction(double value) const {
  if (logarithmic) return std::log(value / low) / std::log(high / low);
  return (value - low) / (high - low);
}

std::vector<Tick> ticks(const Axis& axis, int count) {
  if (axis.logarithmic) {
    std::vector<Tick> list;
    const double decades = std::log10(axis.high / axis.low);
    const int every = std::max(1, static_cast<int>(std::ceil(decades / count)));
    for (int p = static_cast<int>(std::ceil(std::log10(axis.low) - 1e-9));
         p <= std::log10(axis.high) + 1e-9; p += every) {
      list.push_back({std::pow(10, p), brief(std::pow(10, p))});
    }
    return list;
  }
  // One tick alone shows no scale.
  const double step = (axis.high - axis.low) / count;
  std::vector<Tick> list = multiples(axis, round_step(step));
  return list.size() > 1 ? list : multiples(axis, round_step(step / 2));
}

Axis axis_for(const std::vector<double>& values, bool logarithmic) {
  std::vector<double> usable = values;
  keep_usable(usable, logarithmic);
  if (usable.empty()) return {logarithmic ? 0.1 : 0.0, 1, logarithmic};
  const auto [low, high] = std::minmax_element(usable.begin(), usable.end());
  return around(*low, *high, logarithmic);
}

Axis axis_without_extremes(std::vector<double> values, bool logarithmic) {
  keep_usable(values, logarithmic);
  if (values.size() < 20) return axis_for(values, logarithmic);
  std::sort(values.begin(), values.end());
  const std::size_t out = values.size() / 50;
  const double low = values[out];
  const double high = values[values.size() - 1 - out];
  const double all = values.back() - values.front();
  if (high > low && all > 2 * (high - low)) {
    const double air = logarithmic ? 0 : 0.25 * (high - low);
    return around(low - air, high + air, logarithmic);
  }
  return around(values.front(), values.back(), logarithmic);
}

std::string brief(double value, int digits) {
  if (std::isnan(value)) return "\xE2\x80\x93";  // en dash
  if (std::isinf(value)) return value > 0 ? "\xE2\x88\x9E" : "-\xE2\x88\x9E";
  if (value == 0) return "0";
  const double size = std::abs(value);
  if (size < 1e-4 || size >= 1e9) {
    char exponent[40];
    std::snprintf(exponent, sizeof exponent, "%.*g", digits, value);
    return exponent;
  }
  const int before = static_cast<int>(std::floor(std::log10(size))) + 1;
  std::string text = fixed(value, std::max(0, digits - before));
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

}  // namespace berth::report
