// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace berth::console {

/// A procedure that may be run, as its file describes it.
struct Runnable {
  struct Parameter {
    std::string name;
    std::string value;        ///< its own, as it stands there: "20 mm/s"
    std::string description;  ///< the comment on it
  };
  std::string file;  ///< below the directory of procedures: "library/sun_sweep.yaml"
  std::string title;
  std::string description;
  std::vector<Parameter> parameters;
};

/// All procedures below a directory, sorted by file; those that are not read are left out: berth
/// check reports what is wrong with them.
std::vector<Runnable> runnables(const std::filesystem::path& directory);

/// The section `procedures`.
std::string to_json(const std::vector<Runnable>& runnables);

}  // namespace berth::console
