// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/runs/replay/player.h"

namespace berth {

struct ReplayRequest {
  std::filesystem::path run;  ///< run directory or log
  std::string url;            ///< empty: as bus_url
  PlayerOptions player;
  std::vector<std::string> remap;
  std::string only;
  std::string without;
  bool force = false;     ///< also where a cell is alive
  bool estimate = false;  ///< with a live estimator
  std::filesystem::path config;
  std::vector<std::string> set;
};

/// The recorded estimates are published under this name when a live estimator runs as well.
inline constexpr char recorded_estimate_channel[] = "POSE_ESTIMATE_RECORDED";

/// Plays until the end, a key or a signal. @return the exit code
/// @throws InputError for what is wrong in the request, and where a cell is alive on the bus.
int replay(const ReplayRequest& request);

}  // namespace berth
