// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/drive/confirmations.h"

#include "common/core/valid_text.h"

namespace berth::console {
namespace {

std::string what_of(const Command& command) {
  return command.name + " " + json_text(command.arguments);
}

}  // namespace

std::string Confirmations::ask(const Command& command, Utime now) {
  Asked& asked = asked_[command.viewer];
  asked = {"yes-" + std::to_string(++count_), what_of(command), now + confirm_lifetime};
  return asked.word;
}

bool Confirmations::given(const Command& command, Utime now) {
  if (command.confirm.empty()) return false;
  const auto found = asked_.find(command.viewer);
  if (found == asked_.end()) return false;
  const Asked asked = found->second;
  asked_.erase(found);
  return command.confirm == asked.word && what_of(command) == asked.what && now <= asked.until;
}

}  // namespace berth::console
