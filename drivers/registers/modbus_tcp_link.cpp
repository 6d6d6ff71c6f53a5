// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/registers/modbus_tcp_link.h"

#include <sys/socket.h>

#include <cerrno>

#include "common/bus/process_loop.h"
#include "common/bus/sockets.h"

namespace berth {
namespace {

/// @return request.count; -1 with errno: not carried out.
int carry(modbus_t* modbus, const RegisterRequest& request, RegisterAnswer& answer) {
  using Kind = RegisterRequest::Kind;
  const int address = request.first - 1;
  const auto count = static_cast<std::size_t>(request.count);
  switch (request.kind) {
    case Kind::read_registers:
      answer.words.resize(count);
      return modbus_read_registers(modbus, address, request.count, answer.words.data());
    case Kind::read_coils:
      answer.bits.resize(count);
      return modbus_read_bits(modbus, address, request.count, answer.bits.data());
    case Kind::read_inputs:
      answer.bits.resize(count);
      return modbus_read_input_bits(modbus, address, request.count, answer.bits.data());
    case Kind::write_registers:
      return modbus_write_registers(modbus, address, request.count, request.words.data());
    case Kind::write_coil:
      break;
  }
  return modbus_write_bit(modbus, address, request.on ? 1 : 0);
}

/// What a request has come to, on the worker.
struct Exchange {
  RegisterRequest request;
  RegisterAnswer answer{};
  std::string loss{};  // why the connection is of no use any more
};

void exchange(modbus_t* modbus, const ProcessLoop& loop, const std::string& late, Exchange& one) {
  one.answer.sent = loop.now();
  const int carried = carry(modbus, one.request, one.answer);
  const int error = errno;
  one.answer.received = loop.now();
  if (carried == one.request.count) return;
  if (error > MODBUS_ENOBASE && error <= EMBXGTAR) {
    one.answer.refuse(error - MODBUS_ENOBASE);
  } else if (error == ETIMEDOUT) {
    one.loss = late;
  } else if (error >= MODBUS_ENOBASE) {
    one.loss = std::string("the device sent no answer to the request (libmodbus: ") +
               modbus_strerror(error) + ")";
  } else if (error == EAGAIN || error == EWOULDBLOCK) {
    one.loss = "the device takes no request";
  } else {
    one.loss = "the device closed the connection";
  }
}

}  // namespace

ModbusTcpLink::ModbusTcpLink(ProcessLoop& loop, Options options, ConnectionChanged changed)
    : RegisterLink(loop, std::move(options), std::move(changed)),
      loop_(loop),
      worker_(loop.make_worker()) {
  worker_->give({"priority", second, [priority = ThreadPriority()] { priority.take(); }, [] {}});
  ModbusTcpLink::dial();
}

ModbusTcpLink::~ModbusTcpLink() {
  if (modbus_) shutdown(modbus_get_socket(modbus_.get()), SHUT_RDWR);  // so that nothing waits
  worker_.reset();
}

void ModbusTcpLink::dial() {
  Sockets& sockets = loop_.sockets();
  sockets.dial(
      options().address,
      [this, &sockets, alive = std::weak_ptr<bool>(alive_)](Socket socket) {
        if (alive.expired()) return;
        if (socket.fd() < 0) return dialled(false, sockets.trouble(options().address));
        modbus_ = make_modbus_context(socket.release(), options().unit, options().timeout);
        dialled(true, "");
      },
      options().dial_timeout);
}

void ModbusTcpLink::send(const RegisterRequest& request) {
  const auto one = std::make_shared<Exchange>(Exchange{request});
  worker_->give({"Modbus request", options().timeout + second,
                 [this, modbus = modbus_.get(), one] { exchange(modbus, loop_, late(), *one); },
                 [this, one] { one->loss.empty() ? answered(one->answer) : lost(one->loss); }});
}

void ModbusTcpLink::close() { modbus_.reset(); }

}  // namespace berth
