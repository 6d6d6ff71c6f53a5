// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace berth {

/// Setup of a run, the same for all of its nodes.
struct RunSetup {
  std::filesystem::path config;  ///< directory of configuration files, as in config/
  std::string layout = "range";  ///< config/layouts/<layout>.yaml
  std::string target;            ///< as of load_target()
  double target_length = 0;      ///< m; 0: not scaled
  std::uint64_t seed = 1;        ///< of all simulated random numbers
  std::int64_t session = 1;      ///< id of the run on the bus
  std::filesystem::path out;     ///< where a node may write files next to the log; empty: nowhere

  std::filesystem::path layout_file() const { return config / "layouts" / (layout + ".yaml"); }
};

}  // namespace berth
