// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/operator_link.h"

#include <unistd.h>

#include <cstdlib>
#include <utility>

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
  if (command.command == procedure_command_t::HOLD ||
      command.command == procedure_command_t::ABORT) {
    unacknowledged_.push_back(std::move(command));
    if (!std::exchange(repeating_, true)) loop_.after(repeat_after, [this] { repeat_stops(); });
    return;
  }
  for (int i = 1; i <= repeats; ++i) {
    loop_.after(i * repeat_after,
                [this, command] { bus_.publish(channels::procedure_command, command); });
  }
}

void OperatorLink::repeat_stops() {
  repeating_ = !unacknowledged_.empty();
  if (!repeating_) return;
  for (const auto& stop : unacknowledged_) bus_.publish(channels::procedure_command, stop);
  loop_.after(repeat_after, [this] { repeat_stops(); });
}

void OperatorLink::on(const event_t& event) {
  if (event.session != session_ || event.code != "operator-command") return;
  std::erase_if(unacknowledged_, [&](const procedure_command_t& stop) {
    const std::string what = stop.command == procedure_command_t::HOLD ? "hold" : "abort";
    return event.text.rfind(name_ + ": " + what, 0) == 0;
  });
}

void OperatorLink::on(const procedure_state_t& state) {
  if (state.session != session_) return;
  std::erase_if(unacknowledged_, [&](const procedure_command_t& stop) {
    const bool ends = state.state == procedure_state_t::TEARDOWN && stop.utime < state.utime;
    const bool holds = state.state == procedure_state_t::HELD && stop.utime < state.utime &&
                       stop.command == procedure_command_t::HOLD;
    return ends || holds || state.state == procedure_state_t::FINISHED;
  });
}

}  // namespace berth
