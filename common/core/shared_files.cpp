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

}  // namespace berth
