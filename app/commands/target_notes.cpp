// SPDX-License-Identifier: BSD-3-Clause
#include "app/commands/target_notes.h"

#include <cstdio>

namespace berth::commands {

void print_notes(const std::vector<std::string>& notes, const std::string& named) {
  for (const std::string& note : notes) {
    std::fprintf(stderr, "berth: %s: %s\n", named.c_str(), note.c_str());
  }
}

}  // namespace berth::commands
