// SPDX-License-Identifier: BSD-3-Clause
#include "common/bus/commands.h"

#include <algorithm>

namespace berth {
namespace {

constexpr std::size_t max_remembered = 1000;
constexpr std::size_t max_published = 16;
constexpr Utime publish_for = 10 * second;
constexpr Utime publish_period = 500 * millisecond;

}  // namespace

CommandAnswers::CommandAnswers(Bus& bus, Loop& loop, std::string channel, std::int64_t session)
    : bus_(bus), loop_(loop), channel_(std::move(channel)), session_(session) {
  timer_ = loop_.every(publish_period, [this] {
    if (current().answer_count > 0) publish();
  });
}

CommandAnswers::~CommandAnswers() { loop_.cancel(timer_); }

CommandAnswers::Remembered CommandAnswers::take(const command_answer_t& named) {
  const auto found = std::find_if(commands_.begin(), commands_.end(), [&](const Remembered& one) {
    return same_command(one.answer, named);
  });
  Remembered taken{named};
  if (found == commands_.end()) return taken;
  taken = std::move(*found);
  commands_.erase(found);
  return taken;
}

bool CommandAnswers::add(const command_answer_t& named) {
  const std::size_t before = commands_.size();
  Remembered command = take(named);
  const bool is_new = commands_.size() == before;
  command.last_received = loop_.now();
  const bool given = command.given;
  commands_.push_front(std::move(command));
  if (commands_.size() > max_remembered) commands_.pop_back();
  if (given) publish();
  return is_new;
}

void CommandAnswers::put(command_answer_t answer) {
  take(answer);
  commands_.push_front({std::move(answer), true, loop_.now()});
  publish();
}

/// Fits into one message, however long the commanders' names are.
command_answers_t CommandAnswers::current() const {
  command_answers_t message{};
  message.utime = loop_.now();
  message.session = session_;
  int size = message.getEncodedSize();
  for (const Remembered& command : commands_) {
    const bool old = loop_.now() - command.last_received > publish_for;
    if (old || message.answers.size() == max_published) break;
    const int bytes = command.answer.getEncodedSize();
    if (!command.given || size + bytes > Bus::max_message_bytes) continue;
    size += bytes;
    message.answers.push_back(command.answer);
  }
  message.answer_count = static_cast<std::int32_t>(message.answers.size());
  return message;
}

void CommandAnswers::publish() {
  command_answers_t message = current();
  message.seq = ++seq_;
  bus_.publish(channel_, message);
}

}  // namespace berth
