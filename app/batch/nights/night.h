// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace berth::nights {

/// A request to `berth nightly`.
struct NightRequest {
  std::filesystem::path plan;
  std::filesystem::path out = "nightly";  ///< history.sqlite, index.html and a directory per night
  std::filesystem::path program;          ///< tonight's `berth`
  std::filesystem::path baseline;         ///< instead of the plan's; empty: the plan's
  std::filesystem::path config;           ///< tonight's, where a case names none; empty: as shipped
  std::string name;                       ///< of the night; empty: the date
  int jobs = 0;                           ///< 0: the plan's
  bool afresh = false;                    ///< do not resume an interrupted night
};

/// Runs a night, or the rest of one that was interrupted, to its verdict, with progress on standard
/// output. @return an exit code
/// @throws InputError for a plan, a baseline or an output directory that cannot be used
int run_night(const NightRequest& request);

/// Takes the changes of a finished night for good: the nights that follow compare with it.
void accept_night(const std::filesystem::path& out, const std::string& name);

}  // namespace berth::nights
