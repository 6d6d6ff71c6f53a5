// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/report_sweep.h"
#include "evaluation/report/chart.h"

namespace berth::campaigns {

/// Per cent of the trials that passed over the parameter, with intervals.
report::Chart success_chart(const Sweep& sweep);

/// Median and 95th percentile of a measurement over the parameter, with intervals.
report::Chart measurement_chart(const Sweep& sweep, std::size_t measurement,
                                const MeasurementColumn& column);

/// One number of each group with its interval.
using OfGroup = std::function<Estimated(const Group&)>;
/// Adds line, dots and intervals of a series to a chart on the sweep's axis.
void add_curves(report::Chart& chart, const Sweep& sweep, const Sweep::Series& series,
                const OfGroup& number, const std::string& name, int colour, bool dashed);
/// The sweep's axis below the chart.
void set_axis(report::Chart& chart, const Sweep& sweep);
/// Where a value of the parameter is on that axis.
double place_on_axis(const Sweep& sweep, double x);

/// "98.7 % [98.2, 99.1]"
std::string percent_text(const Estimated& share);

}  // namespace berth::campaigns
