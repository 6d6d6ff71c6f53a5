// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/file.h"

#include <fstream>
#include <sstream>

#include "common/core/error.h"

namespace berth {

std::string read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path.string() + ": cannot be read");
  std::ostringstream content;
  content << in.rdbuf();
  return content.str();
}

}  // namespace berth
