// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/modbus_client.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <new>

namespace berth {
namespace {

constexpr std::size_t function_at = ModbusFrames::header_bytes;
constexpr std::size_t data_at = function_at + 1;

std::uint8_t high(int value) { return static_cast<std::uint8_t>(value >> 8 & 0xff); }
std::uint8_t low(int value) { return static_cast<std::uint8_t>(value & 0xff); }

}  // namespace

ModbusContext make_modbus_context() {
  ModbusContext context(modbus_new_tcp("127.0.0.1", MODBUS_TCP_DEFAULT_PORT));
  if (!context) throw std::bad_alloc();
  return context;
}

ModbusClient::ModbusClient(Loop& loop, Wires& wires, Options options, ConnectionChanged changed)
    : loop_(loop),
      wires_(wires),
      options_(std::move(options)),
      changed_(std::move(changed)),
      context_(make_modbus_context()),
      backoff_(options_.backoff_least) {
  dial();
}

ModbusClient::~ModbusClient() {
  loop_.cancel(timeout_timer_);
  loop_.cancel(dial_timer_);
  if (fd_ >= 0) {
    loop_.unwatch(fd_);
    close(fd_);
  }
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
  const int address = first - 1;
  Request request{
      {low(options_.unit), low(function), high(address), low(address), high(count), low(count)},
      count,
      std::move(done)};
  submit(std::move(request), urgency);
}

void ModbusClient::write_registers(int first, std::span<const Word> words, Done done,
                                   Urgency urgency) {
  const int address = first - 1;
  const int count = static_cast<int>(words.size());
  Request request{{low(options_.unit), MODBUS_FC_WRITE_MULTIPLE_REGISTERS, high(address),
                   low(address), high(count), low(count), low(2 * count)},
                  count,
                  std::move(done)};
  request.bytes.reserve(7 + 2 * words.size());
  for (const Word word : words) {
    request.bytes.push_back(high(word));
    request.bytes.push_back(low(word));
  }
  submit(std::move(request), urgency);
}

void ModbusClient::write_coil(int coil, bool on, Done done, Urgency urgency) {
  const int address = coil - 1;
  Request request{{low(options_.unit), MODBUS_FC_WRITE_SINGLE_COIL, high(address), low(address),
                   low(on ? 0xff : 0), 0},
                  1,
                  std::move(done)};
  submit(std::move(request), urgency);
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
  if (under_way_ || waiting_.empty() || !connected()) return;
  current_ = std::move(waiting_.front());
  waiting_.pop_front();
  under_way_ = true;
  sent_ = loop_.now();
  if (modbus_send_raw_request(context_.get(), current_.bytes.data(),
                              static_cast<int>(current_.bytes.size())) < 0) {
    const std::string why = modbus_strerror(errno);
    // Not from inside the caller's own call.
    timeout_timer_ = loop_.after(0, [this, why] { reconnect("request not sent: " + why); });
    return;
  }
  timeout_timer_ = loop_.after(options_.timeout, [this] { on_timeout(); });
}

void ModbusClient::dial() {
  dial_timer_ = 0;
  wires_.dial(options_.address, [this, alive = std::weak_ptr<bool>(alive_)](int fd) {
    if (alive.expired()) {
      if (fd >= 0) close(fd);
      return;
    }
    on_dialled(fd);
  });
}

void ModbusClient::on_dialled(int fd) {
  if (fd < 0) {
    dial_timer_ = loop_.after(backoff_, [this] { dial(); });
    backoff_ = std::min(2 * backoff_, options_.backoff_most);
    return;
  }
  fd_ = fd;
  frames_.clear();
  modbus_set_socket(context_.get(), fd_);
  loop_.watch(fd_, [this] { on_readable(); });
  if (changed_) changed_(true, "");
}

void ModbusClient::reconnect(const std::string& reason) {
  if (!connected()) return;
  loop_.cancel(timeout_timer_);
  loop_.unwatch(fd_);
  close(fd_);
  fd_ = -1;
  dial_timer_ = loop_.after(backoff_, [this] { dial(); });
  backoff_ = std::min(2 * backoff_, options_.backoff_most);

  ModbusAnswer answer;
  answer.error = reason;
  answer.received = loop_.now();
  std::vector<Done> pending;
  if (under_way_) pending.push_back(std::move(current_.done));
  under_way_ = false;
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
  if (!frames_.fill(fd_)) return reconnect("the device closed the connection");
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

std::string ModbusClient::check(std::span<const std::uint8_t> frame) const {
  const std::vector<std::uint8_t>& asked = current_.bytes;
  const std::size_t data_bytes = frame.size() - data_at;
  // libmodbus 3.1.6 sends raw requests as transaction 0.
  if (frame[0] != 0 || frame[1] != 0) return "answer to another transaction";
  if (frame[6] != asked[0]) return "answer of another unit";
  if ((frame[function_at] & 0x7f) != asked[1]) return "answer to another function";
  if ((frame[function_at] & 0x80) != 0) return data_bytes == 1 ? "" : "damaged exception";
  std::size_t expected = 0;
  switch (asked[1]) {
    case MODBUS_FC_READ_HOLDING_REGISTERS:
      expected = 2 * static_cast<std::size_t>(current_.count);
      break;
    case MODBUS_FC_READ_COILS:
    case MODBUS_FC_READ_DISCRETE_INPUTS:
      expected = (static_cast<std::size_t>(current_.count) + 7) / 8;
      break;
    default:  // writes: the first four bytes of the request come back
      if (data_bytes != 4 || !std::equal(frame.begin() + data_at, frame.end(), asked.begin() + 2)) {
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
  if (!under_way_) return reconnect("the device answered what was not asked");
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
    words_.resize(static_cast<std::size_t>(current_.count));
    for (std::size_t i = 0; i < words_.size(); ++i) {
      words_[i] = static_cast<Word>(frame[data_at + 1 + 2 * i] << 8 | frame[data_at + 2 + 2 * i]);
    }
    answer.words = words_;
  } else if (frame[function_at] == MODBUS_FC_READ_COILS ||
             frame[function_at] == MODBUS_FC_READ_DISCRETE_INPUTS) {
    bits_.resize(static_cast<std::size_t>(current_.count));
    for (std::size_t i = 0; i < bits_.size(); ++i) {
      bits_[i] = frame[data_at + 1 + i / 8] >> (i % 8) & 1;
    }
    answer.bits = bits_;
  }
  const Done done = std::move(current_.done);
  under_way_ = false;
  const std::weak_ptr<bool> alive = alive_;
  if (done) done(answer);
  if (!alive.expired()) send_next();
}

}  // namespace berth
