// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace berth {

/// The present name of a key of a user's files; nothing where it was not renamed. path: the key's
/// former path: "scan_planner.least_margin".
std::optional<std::string> present_name(const std::string& path);

struct Renamed {
  int line = 0;
  std::string before, now;  ///< paths
};

/// A YAML text in which renamed keys have their present names; all else, comments too, is
/// unchanged. name stands in for the file in messages. @throws InputError as read_yaml().
std::string with_present_names(const std::string& text, const std::string& name,
                               std::vector<Renamed>* renamed = nullptr);

}  // namespace berth
