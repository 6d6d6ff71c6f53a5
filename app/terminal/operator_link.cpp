// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/operator_link.h"

#include <unistd.h>

#include <cstdlib>

#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr Utime lifetime = 5 * second;
constexpr Utime repeat_after = 100 * millisecond;
constexpr int repeats = 2;

/// Who asks: the engine tells commands of several terminals apart by it.
std::string operator_name() {
  const char* user = std::getenv("USER");
  return std::string(user != nullptr && *user != '\0' ? user : "operator") + " (process " +
         std::to_string(getpid()) + ")";
}

}  // namespace

OperatorLink::OperatorLink(Bus& bus, Loop& loop, std::int64_t session)
    : bus_(bus), loop_(loop), session_(session), name_(operator_name()) {}

void OperatorLink::send(procedure_command_t command) {
  command.utime = loop_.now();
  command.seq = ++seq_;
  command.session = session_;
  command.utime_expires = command.utime + lifetime;
  command.commander = name_;
  bus_.publish(channels::procedure_command, command);
  for (int i = 1; i <= repeats; ++i) {
    loop_.after(i * repeat_after,
                [this, command] { bus_.publish(channels::procedure_command, command); });
  }
}

}  // namespace berth
