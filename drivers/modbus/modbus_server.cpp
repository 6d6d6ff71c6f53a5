// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/modbus_server.h"

#include <modbus/modbus.h>

#include <algorithm>
#include <array>

#include "drivers/modbus/requests.h"

namespace berth {
namespace {

constexpr int gateway_target = MODBUS_EXCEPTION_GATEWAY_TARGET;

}  // namespace

ModbusServer::ModbusServer(Loop& loop, Options options, ModbusImage& image, Hook before_read,
                           Hook after_write)
    : loop_(loop),
      options_(std::move(options)),
      image_(image),
      before_read_(std::move(before_read)),
      after_write_(std::move(after_write)) {
  loop_.wires().listen(options_.address,
                       [this, alive = std::weak_ptr<bool>(alive_)](std::unique_ptr<Wire> wire) {
                         if (!alive.expired()) on_accepted(std::move(wire));
                       });
  idle_timer_ = loop_.every(second, [this] { drop_idle(); });
}

ModbusServer::~ModbusServer() { loop_.cancel(idle_timer_); }

void ModbusServer::on_accepted(std::unique_ptr<Wire> wire) {
  if (connections() >= options_.connections) return;
  auto connection = std::make_unique<Connection>();
  connection->wire = std::move(wire);
  connection->id = ++last_id_;
  connection->last_heard = loop_.now();
  connection->wire->watch([this, id = connection->id] { on_readable(id); });
  connections_.push_back(std::move(connection));
}

ModbusServer::Connection* ModbusServer::connection(std::uint64_t id) {
  const auto found = std::find_if(connections_.begin(), connections_.end(),
                                  [&](const auto& c) { return c->id == id; });
  return found == connections_.end() ? nullptr : found->get();
}

void ModbusServer::on_readable(std::uint64_t id) {
  Connection& from = *connection(id);
  if (!from.frames.fill(*from.wire)) return drop(id);
  while (true) {
    bool damaged = false;
    const auto frame = from.frames.next(damaged);
    if (damaged) return drop(id);
    if (frame.empty()) return;
    from.last_heard = loop_.now();
    if (!take(from, frame)) return drop(id);
  }
}

bool ModbusServer::take(Connection& from, std::span<const std::uint8_t> frame) {
  if (faults_.silent) return true;
  if (faults_.garbage) {
    std::array<std::uint8_t, 32> noise{};  // no length field in it is one of Modbus
    noise.fill(0xa5);
    return from.wire->write(noise) == noise.size();
  }
  if (faults_.delay == 0) return answer(*from.wire, frame);
  loop_.after(faults_.delay, [this, alive = std::weak_ptr<bool>(alive_), id = from.id,
                              bytes = std::vector<std::uint8_t>(frame.begin(), frame.end())] {
    if (alive.expired()) return;
    Connection* const to = connection(id);
    if (to != nullptr && !answer(*to->wire, bytes)) drop(id);
  });
  return true;
}

bool ModbusServer::answer(Wire& wire, std::span<const std::uint8_t> frame) {
  const auto send = [&](ModbusFrame answer) {
    const auto bytes = answer.bytes();
    return wire.write(bytes) == bytes.size();  // whoever does not read is cut off
  };
  const ModbusAccess access = inspect(frame, image_);
  const int exception = frame[6] != options_.unit ? gateway_target
                        : faults_.exception != 0  ? faults_.exception
                                                  : access.exception;
  if (exception != 0) return send(refuse(frame, exception));
  if (!access.write && before_read_) before_read_(access.table, access.first, access.count);
  const bool sent = send(carry_out(frame, access, image_));
  if (access.write && after_write_) after_write_(access.table, access.first, access.count);
  return sent;
}

void ModbusServer::drop(std::uint64_t id) {
  std::erase_if(connections_, [&](const auto& c) { return c->id == id; });
}

void ModbusServer::drop_connections() { connections_.clear(); }

void ModbusServer::drop_connection(std::size_t n) { drop(connections_.at(n)->id); }

void ModbusServer::half_open() {
  for (std::size_t n = 0; n < connections_.size(); ++n) half_open(n);
}

void ModbusServer::half_open(std::size_t n) { connections_.at(n)->wire->unwatch(); }

void ModbusServer::drop_idle() {
  const Utime limit = loop_.now() - options_.idle_timeout;
  std::erase_if(connections_, [&](const auto& c) { return c->last_heard < limit; });
}

}  // namespace berth
