// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/copy_writable.h"

namespace berth {
namespace fs = std::filesystem;

void copy_writable(const fs::path& from, const fs::path& to) {
  if (fs::is_directory(from)) {
    fs::create_directory(to);
    for (const auto& entry : fs::directory_iterator(from)) {
      copy_writable(entry.path(), to / entry.path().filename());
    }
    return;
  }
  fs::copy_file(from, to, fs::copy_options::overwrite_existing);
  fs::permissions(to, fs::perms::owner_write, fs::perm_options::add);
}

}  // namespace berth
