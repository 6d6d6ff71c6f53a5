// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/modbus_client.h"

#include <modbus/modbus.h>

#include <algorithm>
#include <cassert>

namespace berth {
namespace {

constexpr std::size_t function_at = ModbusFrame::function_at;
constexpr std::size_t data_at = ModbusFrame::data_at;

}  // namespace

ModbusClient::ModbusClient(Loop& loop, Options options, ConnectionChanged changed)
    : loop_(loop),
      options_(std::move(options)),
      changed_(std::move(changed)),
      backoff_(options_.backoff_least) {
  dial();
}

ModbusClient::~ModbusClient() {
  loop_.cancel(timeout_timer_);
  loop_.cancel(dial_timer_);
}

void ModbusClient::read_registers(int first, int count, Done done, Urgency urgency) {
  read(MODBUS_FC_READ_HOLDING_REGISTERS, first, count, std::move(done), urgency);
}

void ModbusClient::read_coils(int first, int count, Done done, Urgency urgency) {
  read(MODBUS_FC_READ_COILS, first, count, std::move(done), urgency);
}

void ModbusClient::read_inputs(int first, int count, Done done, Urgency urgency) {
  read(MODBUS_FC_READ_DISCRETE_INPUTS, first, count, std::move(done), urgency);
}

void ModbusClient::read(int function, int first, int count, Done done, Urgency urgency) {
  ModbusFrame frame(options_.unit, function);
  frame.put_word(first - 1);
  frame.put_word(count);
  submit({frame, count, std::move(done)}, urgency);
}

void ModbusClient::write_registers(int first, std::span<const Word> words, Done done,
                                   Urgency urgency) {
  const int count = static_cast<int>(words.size());
  assert(count <= MODBUS_MAX_WRITE_REGISTERS);
  ModbusFrame frame(options_.unit, MODBUS_FC_WRITE_MULTIPLE_REGISTERS);
  frame.put_word(first - 1);
  frame.put_word(count);
  frame.put_byte(2 * count);
  for (const Word word : words) frame.put_word(word);
  submit({frame, count, std::move(done)}, urgency);
}

void ModbusClient::write_coil(int coil, bool on, Done done, Urgency urgency) {
  ModbusFrame frame(options_.unit, MODBUS_FC_WRITE_SINGLE_COIL);
  frame.put_word(coil - 1);
  frame.put_word(on ? 0xff00 : 0);
  submit({frame, 1, std::move(done)}, urgency);
}

void ModbusClient::submit(Request request, Urgency urgency) {
  if (!connected()) {
    ModbusAnswer answer;
    answer.error = "not connected";
    answer.sent = answer.received = loop_.now();
    request.done(answer);
    return;
  }
  if (urgency == Urgency::first) {
    waiting_.push_front(std::move(request));
  } else {
    waiting_.push_back(std::move(request));
  }
  send_next();
}

void ModbusClient::send_next() {
  if (current_ || waiting_.empty() || !connected()) return;
  current_ = std::move(waiting_.front());
  waiting_.pop_front();
  sent_ = loop_.now();
  current_->frame.set_transaction(transaction_++);
  const auto bytes = current_->frame.bytes();
  if (wire_->write(bytes) != bytes.size()) {
    // Not from inside the caller's own call.
    timeout_timer_ = loop_.after(0, [this] { reconnect("the device takes no request"); });
    return;
  }
  timeout_timer_ = loop_.after(options_.timeout, [this] { on_timeout(); });
}

void ModbusClient::dial() {
  dial_timer_ = 0;
  loop_.wires().dial(
      options_.address,
      [this, alive = std::weak_ptr<bool>(alive_)](std::unique_ptr<Wire> wire) {
        if (!alive.expired()) on_dialled(std::move(wire));
      },
      options_.dial_timeout);
}

void ModbusClient::on_dialled(std::unique_ptr<Wire> wire) {
  if (!wire) {
    dial_timer_ = loop_.after(backoff_, [this] { dial(); });
    backoff_ = std::min(2 * backoff_, options_.backoff_most);
    const std::string trouble = loop_.wires().trouble(options_.address);
    const bool news = !trouble.empty() && trouble != trouble_;
    trouble_ = trouble;
    if (news && changed_) changed_(false, trouble);
    return;
  }
  trouble_.clear();
  wire_ = std::move(wire);
  frames_.clear();
  wire_->watch([this] { on_readable(); });
  if (changed_) changed_(true, "");
}

void ModbusClient::reconnect(const std::string& reason) {
  if (!connected()) return;
  loop_.cancel(timeout_timer_);
  wire_.reset();
  dial_timer_ = loop_.after(backoff_, [this] { dial(); });
  backoff_ = std::min(2 * backoff_, options_.backoff_most);

  ModbusAnswer answer;
  answer.error = reason;
  answer.received = loop_.now();
  std::vector<Done> pending;
  if (current_) pending.push_back(std::move(current_->done));
  current_.reset();
  for (Request& request : waiting_) pending.push_back(std::move(request.done));
  waiting_.clear();
  const std::weak_ptr<bool> alive = alive_;
  for (const Done& done : pending) {
    done(answer);
    if (alive.expired()) return;
  }
  if (changed_) changed_(false, reason);
}

void ModbusClient::on_timeout() {
  reconnect("no answer within " + std::to_string(options_.timeout / millisecond) + " ms");
}

void ModbusClient::on_readable() {
  if (!frames_.fill(*wire_)) return reconnect("the device closed the connection");
  const std::weak_ptr<bool> alive = alive_;
  while (true) {
    bool damaged = false;
    const auto frame = frames_.next(damaged);
    if (damaged) return reconnect("the device sent bytes that are not Modbus");
    if (frame.empty()) return;
    on_frame(frame);
    if (alive.expired() || !connected()) return;
  }
}

std::string ModbusClient::check(std::span<const std::uint8_t> frame) {
  const auto asked = current_->frame.bytes();
  const std::size_t data_bytes = frame.size() - data_at;
  if (frame[0] != asked[0] || frame[1] != asked[1]) return "answer to another transaction";
  if (frame[6] != asked[6]) return "answer of another unit";
  if ((frame[function_at] & 0x7f) != asked[function_at]) return "answer to another function";
  if ((frame[function_at] & 0x80) != 0) return data_bytes == 1 ? "" : "damaged exception";
  std::size_t expected = 0;
  switch (asked[function_at]) {
    case MODBUS_FC_READ_HOLDING_REGISTERS:
      expected = 2 * static_cast<std::size_t>(current_->count);
      break;
    case MODBUS_FC_READ_COILS:
    case MODBUS_FC_READ_DISCRETE_INPUTS:
      expected = (static_cast<std::size_t>(current_->count) + 7) / 8;
      break;
    default:  // writes: the first four bytes of the request come back
      if (data_bytes != 4 ||
          !std::equal(frame.begin() + data_at, frame.end(), asked.begin() + data_at)) {
        return "the device echoed another write";
      }
      return "";
  }
  if (data_bytes != expected + 1 || frame[data_at] != expected) {
    return "short answer: " + std::to_string(data_bytes) + " of " + std::to_string(expected + 1) +
           " bytes";
  }
  return "";
}

void ModbusClient::on_frame(std::span<const std::uint8_t> frame) {
  if (!current_) return reconnect("the device answered what was not asked");
  const std::string wrong = check(frame);
  if (!wrong.empty()) return reconnect(wrong);
  loop_.cancel(timeout_timer_);
  backoff_ = options_.backoff_least;

  ModbusAnswer answer;
  answer.sent = sent_;
  answer.received = loop_.now();
  if ((frame[function_at] & 0x80) != 0) {
    answer.exception = frame[data_at];
    answer.error = std::string("refused: ") + modbus_strerror(MODBUS_ENOBASE + answer.exception);
  } else if (frame[function_at] == MODBUS_FC_READ_HOLDING_REGISTERS) {
    words_.resize(static_cast<std::size_t>(current_->count));
    for (std::size_t i = 0; i < words_.size(); ++i) {
      words_[i] = static_cast<Word>(frame[data_at + 1 + 2 * i] << 8 | frame[data_at + 2 + 2 * i]);
    }
    answer.words = words_;
  } else if (frame[function_at] == MODBUS_FC_READ_COILS ||
             frame[function_at] == MODBUS_FC_READ_DISCRETE_INPUTS) {
    bits_.resize(static_cast<std::size_t>(current_->count));
    for (std::size_t i = 0; i < bits_.size(); ++i) {
      bits_[i] = frame[data_at + 1 + i / 8] >> (i % 8) & 1;
    }
    answer.bits = bits_;
  }
  const Done done = std::move(current_->done);
  current_.reset();
  const std::weak_ptr<bool> alive = alive_;
  if (done) done(answer);
  if (!alive.expired()) send_next();
}

}  // namespace berth
