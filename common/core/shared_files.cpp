// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/shared_files.h"

#include <cstdlib>
#include <string>

#include "common/core/error.h"

namespace berth {
namespace fs = std::filesystem;

fs::path program_directory() { return fs::read_symlink("/proc/self/exe").parent_path(); }

fs::path shared_files() {
  const auto has_files = [](const fs::path& at) { return fs::exists(at / "config" / "layouts"); };
  if (const char* home = std::getenv("BERTH_HOME")) {
    if (has_files(home)) return home;
    throw InputError(std::string("environment variable BERTH_HOME: no config/layouts in '") + home +
                     "'");
  }
  for (fs::path at = program_directory(); at != at.root_path(); at = at.parent_path()) {
    if (has_files(at)) return at;
    if (has_files(at / "share" / "berth")) return at / "share" / "berth";
  }
  throw InputError("Berth's files (config/layouts) are not found; set BERTH_HOME to their place");
}

fs::path here_or_shipped(const fs::path& path) {
  if (path.empty() || path.is_absolute() || fs::exists(path)) return path;
  const fs::path shipped = shared_files() / path;
  return fs::exists(shipped) ? shipped : path;
}

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
