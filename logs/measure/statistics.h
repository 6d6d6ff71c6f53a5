// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace berth::logs {

/// How a series becomes one number. mean, min, max, first and final keep the sign; rms, peak and
/// the percentiles are of the magnitude; deviation is the standard deviation about the mean.
enum class Statistic { rms, mean, peak, min, max, p50, p95, p99, deviation, first, final };

const std::vector<std::string>& statistic_names();
/// Nothing when there is no such name.
std::optional<Statistic> statistic_named(const std::string& name);
const std::string& name_of(Statistic statistic);

/// NaN of an empty series. Percentiles are interpolated between the order statistics.
double compute(Statistic statistic, const std::vector<double>& values);

}  // namespace berth::logs
