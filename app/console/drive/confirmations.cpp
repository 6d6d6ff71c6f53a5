// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/drive/confirmations.h"

#include "common/core/valid_text.h"

namespace berth::console {
namespace {

std::string what_of(const Command& command) {
  return command.name + " " + json_text(command.arguments);
}

}  // namespace

std::string Confirmations::request(const Command& command, Utime now) {
  Pending& pending = pending_[command.viewer];
  pending = {"yes-" + std::to_string(++count_), what_of(command), now + confirm_lifetime};
  return pending.word;
}

bool Confirmations::given(const Command& command, Utime now) {
  if (command.confirm.empty()) return false;
  const auto found = pending_.find(command.viewer);
  if (found == pending_.end()) return false;
  const Pending pending = found->second;
  pending_.erase(found);
  return command.confirm == pending.word && what_of(command) == pending.what &&
         now <= pending.until;
}

}  // namespace berth::console
