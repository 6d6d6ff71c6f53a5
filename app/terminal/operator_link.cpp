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

}  // namespace

std::string OperatorLink::operator_name() {
  const char* user = std::getenv("USER");
  return std::string(user != nullptr && *user != '\0' ? user : "operator") + " (process " +
         std::to_string(getpid()) + ")";
}

OperatorLink::OperatorLink(Bus& bus, Loop& loop, std::int64_t session, std::string name)
    : bus_(bus), loop_(loop), session_(session), name_(std::move(name)) {}

void OperatorLink::complete(procedure_command_t& command) {
  command.utime = loop_.now();
  command.seq = ++seq_;
  command.session = session_;
  command.utime_expires = command.utime + lifetime;
  command.commander = name_;
}

void OperatorLink::keep_control() {
  procedure_command_t command{};
  command.command = procedure_command_t::KEEP_CONTROL;
  complete(command);
  bus_.publish(channels::procedure_command, command);
}

void OperatorLink::send(procedure_command_t command) {
  complete(command);
  bus_.publish(channels::procedure_command, command);
  for (int i = 1; i <= repeats; ++i) {
    loop_.after(i * repeat_after,
                [this, command] { bus_.publish(channels::procedure_command, command); });
  }
}

}  // namespace berth
