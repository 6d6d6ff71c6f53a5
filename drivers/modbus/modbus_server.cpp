// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/modbus/modbus_server.h"

#include <unistd.h>

#include <algorithm>
#include <array>

namespace berth {
namespace {

constexpr int gateway_target = MODBUS_EXCEPTION_GATEWAY_TARGET;

/// What a request touches, or the exception it earns. libmodbus would find these errors too, but
/// sleeps and throws away pending bytes before it says so.
struct Access {
  bool write = false;
  ModbusTable table = ModbusTable::registers;
  int first = 0;  // from 1
  int count = 0;
  int exception = 0;
};

Access inspect(std::span<const std::uint8_t> frame, const modbus_mapping_t& image) {
  const auto pdu = frame.subspan(ModbusFrames::header_bytes);
  const auto number = [&](std::size_t at) { return pdu[at] << 8 | pdu[at + 1]; };
  Access access;
  const auto refuse = [&](int exception) {
    access.exception = exception;
    return access;
  };
  if (pdu.size() < 5) return refuse(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  access.first = number(1) + 1;
  access.count = 1;
  int most = 1;
  std::size_t bytes = 5;
  switch (pdu[0]) {
    case MODBUS_FC_READ_COILS:
    case MODBUS_FC_READ_DISCRETE_INPUTS:
      access.table = pdu[0] == MODBUS_FC_READ_COILS ? ModbusTable::coils : ModbusTable::inputs;
      access.count = number(3);
      most = MODBUS_MAX_READ_BITS;
      break;
    case MODBUS_FC_READ_HOLDING_REGISTERS:
      access.count = number(3);
      most = MODBUS_MAX_READ_REGISTERS;
      break;
    case MODBUS_FC_WRITE_SINGLE_COIL:
      access.write = true;
      access.table = ModbusTable::coils;
      break;
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
      access.write = true;
      break;
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS: {
      const bool coils = pdu[0] == MODBUS_FC_WRITE_MULTIPLE_COILS;
      access.write = true;
      access.table = coils ? ModbusTable::coils : ModbusTable::registers;
      access.count = number(3);
      most = coils ? MODBUS_MAX_WRITE_BITS : MODBUS_MAX_WRITE_REGISTERS;
      const int data = coils ? (access.count + 7) / 8 : 2 * access.count;
      bytes = 6 + static_cast<std::size_t>(data);
      if (pdu.size() < 6 || pdu[5] != data) return refuse(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
      break;
    }
    default:
      return refuse(MODBUS_EXCEPTION_ILLEGAL_FUNCTION);
  }
  if (access.count < 1 || access.count > most || pdu.size() != bytes) {
    return refuse(MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE);
  }
  const int size = access.table == ModbusTable::registers ? image.nb_registers
                   : access.table == ModbusTable::coils   ? image.nb_bits
                                                          : image.nb_input_bits;
  if (access.first + access.count - 1 > size) return refuse(MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  return access;
}

}  // namespace

ModbusServer::ModbusServer(Loop& loop, Wires& wires, Options options, ModbusImage& image,
                           Hook before_read, Hook after_write)
    : loop_(loop),
      options_(std::move(options)),
      image_(image),
      before_read_(std::move(before_read)),
      after_write_(std::move(after_write)),
      context_(make_modbus_context()) {
  modbus_set_response_timeout(context_.get(), 0, 1);  // what it sleeps before some exceptions
  wires.listen(options_.address, [this, alive = std::weak_ptr<bool>(alive_)](int fd) {
    if (alive.expired()) {
      close(fd);
      return;
    }
    on_accepted(fd);
  });
  idle_timer_ = loop_.every(second, [this] { drop_idle(); });
}

ModbusServer::~ModbusServer() {
  loop_.cancel(idle_timer_);
  drop_connections();
}

void ModbusServer::on_accepted(int fd) {
  if (connections() >= options_.connections) {
    close(fd);
    return;
  }
  auto connection = std::make_unique<Connection>();
  connection->fd = fd;
  connection->id = ++last_id_;
  connection->last_heard = loop_.now();
  connections_.push_back(std::move(connection));
  loop_.watch(fd, [this, fd] { on_readable(fd); });
}

void ModbusServer::on_readable(int fd) {
  const auto found = std::find_if(connections_.begin(), connections_.end(),
                                  [&](const auto& c) { return c->fd == fd; });
  if (found == connections_.end()) return;
  Connection& connection = **found;
  if (!connection.frames.fill(fd)) return drop(fd);
  while (true) {
    bool damaged = false;
    const auto frame = connection.frames.next(damaged);
    if (damaged) return drop(fd);
    if (frame.empty()) return;
    connection.last_heard = loop_.now();
    if (!take(connection, frame)) return drop(fd);
  }
}

bool ModbusServer::take(const Connection& connection, std::span<const std::uint8_t> frame) {
  if (faults_.silent) return true;
  if (faults_.garbage) {
    std::array<std::uint8_t, 32> noise{};  // no length field in it is one of Modbus
    noise.fill(0xa5);
    return ::write(connection.fd, noise.data(), noise.size()) > 0;
  }
  if (faults_.delay == 0) return answer(connection.fd, frame);
  loop_.after(faults_.delay, [this, alive = std::weak_ptr<bool>(alive_), id = connection.id,
                              bytes = std::vector<std::uint8_t>(frame.begin(), frame.end())] {
    if (alive.expired()) return;
    const auto found = std::find_if(connections_.begin(), connections_.end(),
                                    [&](const auto& c) { return c->id == id; });
    if (found != connections_.end() && !answer((*found)->fd, bytes)) drop((*found)->fd);
  });
  return true;
}

bool ModbusServer::answer(int fd, std::span<const std::uint8_t> frame) {
  modbus_set_socket(context_.get(), fd);
  const Access access = inspect(frame, *image_.mapping());
  const int exception = frame[6] != options_.unit ? gateway_target
                        : faults_.exception != 0  ? faults_.exception
                                                  : access.exception;
  if (exception != 0) {
    return modbus_reply_exception(context_.get(), frame.data(), static_cast<unsigned>(exception)) >
           0;
  }
  if (!access.write && before_read_) before_read_(access.table, access.first, access.count);
  const int sent =
      modbus_reply(context_.get(), frame.data(), static_cast<int>(frame.size()), image_.mapping());
  if (access.write && after_write_) after_write_(access.table, access.first, access.count);
  return sent > 0;
}

void ModbusServer::drop(int fd) {
  loop_.unwatch(fd);
  close(fd);
  std::erase_if(connections_, [&](const auto& c) { return c->fd == fd; });
}

void ModbusServer::drop_connections() {
  while (!connections_.empty()) drop(connections_.front()->fd);
}

void ModbusServer::half_open() {
  for (const auto& connection : connections_) loop_.unwatch(connection->fd);
}

void ModbusServer::drop_idle() {
  const Utime limit = loop_.now() - options_.idle_timeout;
  std::vector<int> idle;
  for (const auto& connection : connections_) {
    if (connection->last_heard < limit) idle.push_back(connection->fd);
  }
  for (const int fd : idle) drop(fd);
}

}  // namespace berth
