// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "app/batch/campaigns/report_sweep.h"
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
report::Html campaign_head(const ReportView& view);
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
/// The paper's Figure 7 beside ours; of the acquisition experiment alone.
report::Html figure_7_section(const ReportView& view);
report::Html manifest_section(const ReportView& view);

/// Everything that the charts show, as numbers.
nlohmann::ordered_json numbers_of(const ReportView& view);

}  // namespace berth::campaigns
