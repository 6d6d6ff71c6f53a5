// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/cloud.h"

#include <algorithm>
#include <cctype>

#include "common/clouds/pcl_cloud.h"
#include "common/clouds/ptx_cloud.h"
#include "common/clouds/xyz_cloud.h"
#include "common/core/error.h"
#include "common/core/file.h"

namespace berth::clouds {

namespace {

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

bool is_text(const std::string& extension) {
  return extension == ".xyz" || extension == ".txt" || extension == ".csv";
}

}  // namespace

bool is_cloud(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  return extension == ".pcd" || extension == ".ply" || extension == ".ptx" || is_text(extension);
}

std::string known_extensions() { return ".pcd, .ply, .xyz (.txt, .csv) or .ptx"; }

Cloud read_cloud(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (!is_cloud(path)) {
    throw InputError(path.string() + ": found '" + extension + "', expected a " +
                     known_extensions() + " cloud");
  }
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    throw InputError(path.string() + ": no such file");
  }
  if (extension == ".pcd") return read_pcd(path);
  if (extension == ".ply") return read_ply(path);
  return is_text(extension) ? parse_xyz(read_file(path), path.string())
                            : parse_ptx(read_file(path), path.string());
}

}  // namespace berth::clouds
