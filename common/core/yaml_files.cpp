// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/yaml_files.h"

#include <algorithm>

namespace berth {
namespace fs = std::filesystem;

std::vector<fs::path> yaml_files(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file() && entry.path().extension() == ".yaml") {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

}  // namespace berth
