// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/registers/register_link.h"

#include <modbus/modbus.h>

#include <algorithm>

#include "common/bus/process_loop.h"
#include "common/bus/simulation.h"
#include "drivers/registers/memory_link.h"
#include "drivers/registers/modbus_tcp.h"

namespace berth {
namespace {

using Kind = RegisterRequest::Kind;

int max_count(Kind kind) {
  switch (kind) {
    case Kind::read_registers:
      return MODBUS_MAX_READ_REGISTERS;
    case Kind::write_registers:
      return MODBUS_MAX_WRITE_REGISTERS;
    case Kind::read_coils:
    case Kind::read_inputs:
    case Kind::write_coil:
      break;
  }
  return MODBUS_MAX_READ_BITS;
}

}  // namespace

void RegisterAnswer::refuse(int exception_code) {
  exception = exception_code;
  error = std::string("refused: ") + modbus_strerror(MODBUS_ENOBASE + exception_code);
}

RegisterLink::RegisterLink(Loop& loop, Options options, ConnectionChanged changed)
    : loop_(loop),
      options_(std::move(options)),
      changed_(std::move(changed)),
      backoff_(options_.min_backoff) {}

RegisterLink::~RegisterLink() { loop_.cancel(dial_timer_); }

void RegisterLink::read_registers(int first, int count, Done done, Urgency urgency) {
  submit({{Kind::read_registers, first, count}, std::move(done)}, urgency);
}

void RegisterLink::read_coils(int first, int count, Done done, Urgency urgency) {
  submit({{Kind::read_coils, first, count}, std::move(done)}, urgency);
}

void RegisterLink::read_inputs(int first, int count, Done done, Urgency urgency) {
  submit({{Kind::read_inputs, first, count}, std::move(done)}, urgency);
}

void RegisterLink::write_registers(int first, std::span<const Word> words, Done done,
                                   Urgency urgency) {
  submit(
      {{Kind::write_registers, first, static_cast<int>(words.size()), {words.begin(), words.end()}},
       std::move(done)},
      urgency);
}

void RegisterLink::write_coil(int coil, bool on, Done done, Urgency urgency) {
  submit({{Kind::write_coil, coil, 1, {}, on}, std::move(done)}, urgency);
}

void RegisterLink::submit(Pending pending, Urgency urgency) {
  RegisterAnswer answer;
  if (!connected_) answer.error = "not connected";
  const int count = pending.request.count;
  if (const int max_registers = max_count(pending.request.kind);
      count < 1 || count > max_registers) {
    answer.error =
        std::to_string(count) + " in one request, expected 1 to " + std::to_string(max_registers);
  }
  if (!answer.ok()) {
    answer.sent = answer.received = loop_.now();
    return pending.done(answer);
  }
  if (urgency == Urgency::first) {
    waiting_.push_front(std::move(pending));
  } else {
    waiting_.push_back(std::move(pending));
  }
  send_next();
}

void RegisterLink::send_next() {
  if (current_ || waiting_.empty() || !connected_) return;
  current_ = std::move(waiting_.front());
  waiting_.pop_front();
  send(current_->request);
}

void RegisterLink::dial_later() {
  dial_timer_ = loop_.after(backoff_, [this] {
    dial_timer_ = 0;
    dial();
  });
  backoff_ = std::min(2 * backoff_, options_.max_backoff);
}

void RegisterLink::dialled(bool connected, const std::string& trouble) {
  connected_ = connected;
  if (!connected) dial_later();
  const bool news = connected || (!trouble.empty() && trouble != trouble_);
  trouble_ = trouble;
  if (news && changed_) changed_(connected, trouble);
}

void RegisterLink::answered(const RegisterAnswer& answer) {
  backoff_ = options_.min_backoff;
  const Done done = std::move(current_->done);
  current_.reset();
  const std::weak_ptr<bool> alive = alive_;
  if (done) done(answer);
  if (!alive.expired()) send_next();
}

void RegisterLink::lost(const std::string& reason) {
  if (!connected_) return;
  connected_ = false;
  close();
  dial_later();

  RegisterAnswer answer;
  answer.error = reason;
  answer.received = loop_.now();
  std::vector<Done> pending;
  if (current_) pending.push_back(std::move(current_->done));
  current_.reset();
  for (Pending& one : waiting_) pending.push_back(std::move(one.done));
  waiting_.clear();
  const std::weak_ptr<bool> alive = alive_;
  for (const Done& done : pending) {
    done(answer);
    if (alive.expired()) return;
  }
  if (changed_) changed_(false, reason);
}

std::string RegisterLink::late() const {
  return "no answer within " + std::to_string(options_.timeout / millisecond) + " ms";
}

std::unique_ptr<RegisterLink> make_register_link(Loop& loop, RegisterLink::Options options,
                                                 RegisterLink::ConnectionChanged changed) {
  if (auto* twin = dynamic_cast<SimulatedLoop*>(&loop)) {
    return std::make_unique<MemoryLink>(*twin, std::move(options), std::move(changed));
  }
  return std::make_unique<ModbusTcpLink>(dynamic_cast<ProcessLoop&>(loop), std::move(options),
                                         std::move(changed));
}

}  // namespace berth
