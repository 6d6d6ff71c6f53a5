// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/campaigns/report_table.h"
#include "evaluation/report/chart.h"
#include "evaluation/report/heat_map.h"

namespace berth::campaigns {

/// What the sections of a campaign's report are made of.
struct ReportView {
  const Manifest& manifest;
  std::filesystem::path directory;  ///< of the campaign, for commands and links
  const TrialTable& table;
  Group all;  ///< all trials together
  std::vector<Sweep> sweeps;
};

/// Where in a campaign's directory a trial leaves what there is to look at when it is run again.
inline constexpr char trial_directory[] = "again";

/// Classes of failed trials in per cent.
report::ColourScale failure_scale();

/// The parts of the page. Empty where there is nothing of the kind.
/// Charts and a table of success and errors over one parameter.
report::Html sweep_section(const ReportView& view, const Sweep& sweep);
/// Each two parameters of the grid against each other.
report::Html grid_section(const ReportView& view);
/// Success, errors and coverage over the directions from which the target was seen, and over roll.
report::Html attitude_section(const ReportView& view);
/// Kinds of failure, and where in the grid they happen.
report::Html failure_section(const ReportView& view);
/// Trials with the largest errors, each with the command that runs it again.
report::Html worst_section(const ReportView& view);
/// The paper's Figure 7 and ours side by side; of the acquisition experiment alone.
report::Html figure_7_section(const ReportView& view);

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
