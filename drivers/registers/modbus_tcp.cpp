// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/registers/modbus_tcp.h"

#include <sys/socket.h>

#include <algorithm>
#include <array>
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

/// Outcome of a request, on the worker.
struct Exchange {
  RegisterRequest request;
  RegisterAnswer answer{};
  std::string loss{};  // why the connection is unusable; empty: it is usable
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

constexpr std::size_t protocol_at = 2;
constexpr std::size_t length_at = 4;
constexpr std::size_t unit_at = 6;
constexpr std::size_t function_at = 7;

int word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  return at + 1 < bytes.size() ? bytes[at] << 8 | bytes[at + 1] : -1;
}

/// Above 0, as short as possible: libmodbus sleeps for a server's response time-out before some
/// exceptions.
constexpr Utime pause_before_exception = 1;

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

RegisterAccess access_of(std::span<const std::uint8_t> request, const RegisterImage& image) {
  const auto pdu = request.subspan(function_at);
  RegisterAccess access;
  access.first = word_at(pdu, 1) + 1;
  access.count = 1;
  int max_count = 1;
  std::size_t bytes = 5;
  switch (pdu[0]) {
    case MODBUS_FC_READ_COILS:
    case MODBUS_FC_READ_DISCRETE_INPUTS:
      access.table = pdu[0] == MODBUS_FC_READ_COILS ? RegisterTable::coils : RegisterTable::inputs;
      access.count = word_at(pdu, 3);
      max_count = MODBUS_MAX_READ_BITS;
      break;
    case MODBUS_FC_READ_HOLDING_REGISTERS:
      access.count = word_at(pdu, 3);
      max_count = MODBUS_MAX_READ_REGISTERS;
      break;
    case MODBUS_FC_WRITE_SINGLE_COIL:
      access.writes = true;
      access.table = RegisterTable::coils;
      if (word_at(pdu, 3) != 0 && word_at(pdu, 3) != 0xff00) max_count = 0;
      break;
    case MODBUS_FC_WRITE_SINGLE_REGISTER:
      access.writes = true;
      break;
    case MODBUS_FC_WRITE_MULTIPLE_COILS:
    case MODBUS_FC_WRITE_MULTIPLE_REGISTERS: {
      const bool coils = pdu[0] == MODBUS_FC_WRITE_MULTIPLE_COILS;
      access.writes = true;
      access.table = coils ? RegisterTable::coils : RegisterTable::registers;
      access.count = word_at(pdu, 3);
      max_count = coils ? MODBUS_MAX_WRITE_BITS : MODBUS_MAX_WRITE_REGISTERS;
      const int data = coils ? (access.count + 7) / 8 : 2 * access.count;
      bytes = 6 + static_cast<std::size_t>(data);
      if (pdu.size() < 6 || pdu[5] != data) max_count = 0;
      break;
    }
    default:
      access.exception = MODBUS_EXCEPTION_ILLEGAL_FUNCTION;
      return access;
  }
  if (access.count < 1 || access.count > max_count || pdu.size() != bytes) {
    access.exception = MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE;
  } else if (!image.holds(access.table, access.first, access.count)) {
    access.exception = MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS;
  }
  return access;
}

ModbusTcpServer::ModbusTcpServer(ProcessLoop& loop, Options options, RegisterImage& image,
                                 Hook before_read, Hook after_write)
    : RegisterServer(loop, std::move(options), image, std::move(before_read),
                     std::move(after_write)),
      loop_(loop) {
  loop.sockets().listen(options_.address,
                        [this, alive = std::weak_ptr<bool>(alive_)](Socket socket) {
                          if (!alive.expired()) accept(std::move(socket));
                        });
}

ModbusTcpServer::~ModbusTcpServer() { drop_connections(); }

void ModbusTcpServer::accept(Socket socket) {
  if (connections() >= options_.connections) return;
  Connection& one = *connections_.emplace_back(std::make_unique<Connection>());
  one.id = ++last_id_;
  one.modbus = make_modbus_context(socket.release(), options_.unit, pause_before_exception);
  one.state.last_received = loop_.now();
  one.thread = std::thread([this, &one, priority = ThreadPriority()] {
    priority.take();
    receive(one);
  });
}

/// Posts a task to the loop; dropped when the connection or the server is gone by then.
void ModbusTcpServer::post(std::uint64_t id, std::function<void(Connection&)> task) {
  loop_.post([this, alive = std::weak_ptr<bool>(alive_), id, task = std::move(task)] {
    if (alive.expired()) return;
    if (Connection* const one = connection(id)) task(*one);
  });
}

void ModbusTcpServer::receive(Connection& from) {
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> bytes;
  int size = 0;
  while ((size = modbus_receive(from.modbus.get(), bytes.data())) > 0) {
    post(from.id, [this, request = Request(bytes.begin(), bytes.begin() + size)](Connection& one) {
      take(one, request);
    });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return from.answered || from.ends; });
    if (from.ends) return;
    from.answered = false;
  }
  post(from.id, [this](Connection& one) {
    if (!one.state.deaf) drop(one.id);
  });
}

ModbusTcpServer::Connection* ModbusTcpServer::connection(std::uint64_t id) {
  const auto found = std::find_if(connections_.begin(), connections_.end(),
                                  [&](const auto& one) { return one->id == id; });
  return found == connections_.end() ? nullptr : found->get();
}

void ModbusTcpServer::take(Connection& from, const Request& request) {
  if (from.state.deaf) return go_on(from);
  from.state.last_received = loop_.now();
  if (faults_.silent) return go_on(from);
  if (faults_.garbage) return send_garbage(from) ? go_on(from) : drop(from.id);
  if (faults_.delay == 0) return answer(from, request);
  loop_.after(faults_.delay, [this, alive = std::weak_ptr<bool>(alive_), id = from.id, request] {
    if (alive.expired()) return;
    if (Connection* const one = connection(id)) answer(*one, request);
  });
}

bool ModbusTcpServer::send_garbage(const Connection& to) const {
  std::array<std::uint8_t, 32> noise{};
  noise.fill(0xa5);
  const ssize_t sent =
      send(modbus_get_socket(to.modbus.get()), noise.data(), noise.size(), MSG_NOSIGNAL);
  return sent == static_cast<ssize_t>(noise.size());
}

void ModbusTcpServer::answer(Connection& to, const Request& request) {
  modbus_t* const modbus = to.modbus.get();
  const RegisterAccess access = access_of(request, image_);
  // Of an unknown function libmodbus has read the number only.
  const bool unknown = access.exception == MODBUS_EXCEPTION_ILLEGAL_FUNCTION;
  const int length = static_cast<int>(request.size() - unit_at);
  if (word_at(request, protocol_at) != 0 || (!unknown && word_at(request, length_at) != length)) {
    return drop(to.id);
  }
  if (unknown) modbus_flush(modbus);
  const int exception = !is_addressed_by(request[unit_at]) ? int{MODBUS_EXCEPTION_GATEWAY_TARGET}
                        : faults_.exception != 0           ? faults_.exception
                                                           : access.exception;
  bool sent = false;
  if (exception != 0) {
    sent = modbus_reply_exception(modbus, request.data(), static_cast<unsigned>(exception)) >= 0;
  } else {
    if (!access.writes && before_read_) before_read_(access.table, access.first, access.count);
    modbus_mapping_t mapping{};
    mapping.nb_registers = image_.size(RegisterTable::registers);
    mapping.tab_registers = image_.registers();
    mapping.nb_bits = image_.size(RegisterTable::coils);
    mapping.tab_bits = image_.coils();
    mapping.nb_input_bits = image_.size(RegisterTable::inputs);
    mapping.tab_input_bits = image_.inputs();
    const int size = static_cast<int>(request.size());
    sent = modbus_reply(modbus, request.data(), size, &mapping) >= 0;
    if (access.writes && after_write_) after_write_(access.table, access.first, access.count);
  }
  sent ? go_on(to) : drop(to.id);
}

void ModbusTcpServer::go_on(Connection& connection) {
  {
    const std::lock_guard lock(mutex_);
    connection.answered = true;
  }
  changed_.notify_all();
}

void ModbusTcpServer::drop(std::uint64_t id) {
  Connection* const one = connection(id);
  if (one == nullptr) return;
  {
    const std::lock_guard lock(mutex_);
    one->ends = true;
  }
  changed_.notify_all();
  shutdown(modbus_get_socket(one->modbus.get()), SHUT_RDWR);  // wakes modbus_receive
  one->thread.join();
  std::erase_if(connections_, [&](const auto& c) { return c.get() == one; });
}

}  // namespace berth
