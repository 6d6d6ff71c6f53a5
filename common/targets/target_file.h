// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "common/core/config.h"
#include "common/targets/target.h"

namespace berth {

/// Reads a folder's target.yaml and the mesh that it names (docs/targets.md): strict, a key that is
/// not known or a part without a face is an error. Joints are at rest.
/// @param length as of load_target()
/// @throws InputError "file:line: key ...".
Target read_target_folder(const std::filesystem::path& folder, double length);

/// The docking ports of a description, scaled to the target's length (m). @throws InputError.
/// @param name stands in for the file in messages
std::vector<DockingPort> read_ports(const std::string& text, const std::string& name,
                                    double length);

/// Keys `reflectivity`, `specular` and `roughness`; those left out stay as they are.
/// @throws InputError.
void read_material(Config& config, Material& material);

}  // namespace berth
