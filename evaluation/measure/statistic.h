// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace berth::evaluation {

/// How a series becomes one number. mean, min, max, first and final keep the sign; rms, peak and
/// the percentiles are of the magnitude; deviation is the standard deviation about the mean.
enum class Statistic { rms, mean, peak, min, max, p50, p90, p95, p99, deviation, first, final };

const std::vector<std::string>& statistic_names();
/// Nothing when there is no such name.
std::optional<Statistic> statistic_named(const std::string& name);
const std::string& name_of(Statistic statistic);

/// NaN of an empty series. Percentiles are interpolated between the order statistics.
double compute(Statistic statistic, const std::vector<double>& values);

/// 1 sigma of compute(statistic, values) when the values have these sigmas and fully correlated
/// errors, as those of truth, which are mostly of a calibration and do not average out: that of the
/// value itself for those that pick one, between the two neighbours' for a percentile, the mean for
/// the mean; for rms and deviation the rms, which the triangle inequality bounds them by.
double uncertainty(Statistic statistic, const std::vector<double>& values,
                   const std::vector<double>& sigmas);

}  // namespace berth::evaluation
