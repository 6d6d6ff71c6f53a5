// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/batch/nights/verdict.h"

namespace berth::nights {

/// Writes out/index.html: the last night's verdict, what changed, the nights before, and how every
/// judged quantity went from night to night. One file that needs nothing else.
void write_index_page(const std::filesystem::path& out, const Plan& plan, History& history,
                      const NightReport& report);

}  // namespace berth::nights
