// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <tuple>

#include "app/batch/nights/plan.h"
#include "evaluation/report/chart.h"

namespace berth::nights {

/// What is drawn over the nights.
struct TrendSubject {
  std::string case_name;
  std::string phase;
  std::string measurement;
  std::string statistic;
  std::string unit;

  auto key() const { return std::tie(case_name, phase, measurement, statistic); }
};

/// The median of each night over a band from the 10th to the 90th percentile of its runs; the
/// baseline's median in grey; the nights on which it was flagged as dots.
/// @param nights finished ones, oldest first
report::Chart trend_chart(ResultStore& history, const std::vector<Night>& nights,
                          const TrendSubject& subject, const std::vector<std::int64_t>& flagged);

}  // namespace berth::nights
