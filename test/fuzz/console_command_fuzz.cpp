// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <cstdlib>

#include "app/console/server/access.h"
#include "app/console/server/command.h"
#include "app/console/server/contents.h"
#include "common/core/error.h"

using namespace berth;
using namespace berth::console;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

/// What is taken for a command is one in every respect.
void read_as_command(const std::string& text) {
  try {
    const Command command = parse_command(text);
    require(!command.name.empty() && command.name.size() <= 64 && command.confirm.size() <= 64);
    require(command.arguments.is_object() && command.viewer.empty());
    to_json({command.id, false, command.name + command.confirm, command.confirm});
  } catch (const InputError& e) {
    for (const char c : harmless(e.what())) require(c >= ' ' && c <= '~');
  }
}

/// Nobody is let in without the token, and no path leaves the directories.
void read_as_request(const std::string& text) {
  static const Access access("a-token-that-no-fuzzer-ever-guesses", {"cell.example"}, true);
  PageRequest request{"GET", text, "cell.example", "", text, text};
  require(access.judge(request, 8800).status == 401);
  request = {text, "/", text, text, "", ""};
  require(access.judge(request, 8800).status != 200);
  if (is_plain_path(text)) require(text[0] == '/' && text.find("/..") == std::string::npos);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  read_as_command(text);
  read_as_request(text);
  return 0;
}
