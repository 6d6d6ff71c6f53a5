// SPDX-License-Identifier: BSD-3-Clause
#include "estimator/clouds/cloud.h"

#include <algorithm>
#include <cctype>

#include "common/core/error.h"
#include "common/core/file.h"
#include "estimator/clouds/pcl_cloud.h"
#include "estimator/clouds/ptx_cloud.h"
#include "estimator/clouds/xyz_cloud.h"

namespace berth::estimator {

Cloud read_cloud(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const bool pcl = extension == ".pcd" || extension == ".ply";
  const bool xyz = extension == ".xyz" || extension == ".txt" || extension == ".csv";
  if (!pcl && !xyz && extension != ".ptx") {
    throw InputError(path.string() + ": found '" + extension +
                     "', expected a .pcd, .ply, .xyz (.txt, .csv) or .ptx cloud");
  }
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) {
    throw InputError(path.string() + ": no such file");
  }
  if (extension == ".pcd") return read_pcd(path);
  if (extension == ".ply") return read_ply(path);
  return xyz ? parse_xyz(read_file(path), path.string())
             : parse_ptx(read_file(path), path.string());
}

}  // namespace berth::estimator
