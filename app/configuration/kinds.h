// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace berth {

/// A kind of configuration file, and its reader.
struct ConfigKind {
  std::string name;    ///< "lidar"
  std::string files;   ///< of the shared files, with wildcards: "config/lidars/*.yaml"
  std::string what;    ///< it configures
  std::string schema;  ///< of the sources: "schemas/lidar.json"
  std::function<void(const std::filesystem::path&)> read;  ///< @throws InputError
};

/// All of them but procedures, which have a language of their own.
const std::vector<ConfigKind>& config_kinds();

/// The files of a kind that are shipped; the one that explains the others first.
std::vector<std::filesystem::path> shipped_files(const ConfigKind& kind);

/// @throws InputError naming the kinds there are.
const ConfigKind& config_kind(const std::string& name);
/// By its name and folder. @throws InputError.
const ConfigKind& kind_of_file(const std::filesystem::path& file);

}  // namespace berth
