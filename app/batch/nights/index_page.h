// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/nights/plan.h"
#include "app/batch/nights/verdict.h"
#include "evaluation/report/html.h"

namespace berth::nights {

/// Writes index.html in the directory of the nights: the last night's verdict, what changed, the
/// nights before, and how every judged quantity went from night to night. One file that needs
/// nothing else.
void write_index_page(const Plan& plan, ResultStore& history, const NightReport& report);

/// What the sources of the plan's procedures claim (criteria with a `claim`), and in how many of
/// tonight's runs it was met. Empty where nothing is claimed.
report::Html claims_table(const Plan& plan, const NightReport& report);

}  // namespace berth::nights
