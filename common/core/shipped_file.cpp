// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/shipped_file.h"

#include "common/core/shared_files.h"

namespace berth {
namespace fs = std::filesystem;

fs::path here_or_shipped(const fs::path& path) {
  if (path.empty() || path.is_absolute() || fs::exists(path)) return path;
  const fs::path shipped = shared_files() / path;
  return fs::exists(shipped) ? shipped : path;
}

}  // namespace berth
