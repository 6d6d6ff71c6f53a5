// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <string>
#include <vector>

#include "common/core/config.h"

namespace berth::procedures {

/// One name of a sweep with its values: texts or lists.
struct SweepAxis {
  std::string name;
  std::vector<YamlNode> values;
};

/// Reads every key of a sweep but `steps`: a list of values, or {from, to, step} of quantities,
/// both ends included.
/// @throws InputError.
std::vector<SweepAxis> read_axes(Config& sweep);

/// The names of all sweeps below a node.
std::set<std::string> swept_names(const YamlNode& node);

/// A list of poses, at least one.
std::vector<Pose> read_poses(Config& config, const std::string& key);

}  // namespace berth::procedures
