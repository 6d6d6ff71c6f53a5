// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/registers/memory_link.h"

#include <modbus/modbus.h>

#include <algorithm>

#include "common/bus/simulation.h"
#include "common/core/error.h"

namespace berth {
namespace {

/// Of one Simulation, by address.
using MemoryServers = std::map<std::string, MemoryServer*>;

using Connection = std::shared_ptr<MemoryConnection>;

RegisterTable table_of(RegisterRequest::Kind kind) {
  switch (kind) {
    case RegisterRequest::Kind::read_coils:
    case RegisterRequest::Kind::write_coil:
      return RegisterTable::coils;
    case RegisterRequest::Kind::read_inputs:
      return RegisterTable::inputs;
    case RegisterRequest::Kind::read_registers:
    case RegisterRequest::Kind::write_registers:
      break;
  }
  return RegisterTable::registers;
}

}  // namespace

// ---- link ----

MemoryLink::MemoryLink(SimulatedLoop& loop, Options options, ConnectionChanged changed)
    : RegisterLink(loop, std::move(options), std::move(changed)), twin_(loop) {
  MemoryLink::dial();
}

MemoryLink::~MemoryLink() { MemoryLink::close(); }

void MemoryLink::dial() {
  const Utime latency = twin_.simulation().wire_latency();
  twin_.after(latency, [this, latency, alive = std::weak_ptr<bool>(alive_)] {
    if (alive.expired()) return;
    const auto& servers = twin_.simulation().shared<MemoryServers>();
    const auto found = servers.find(options().address);
    if (found == servers.end()) return dialled(false, "");
    MemoryServer& server = *found->second;
    connection_ = std::make_shared<MemoryConnection>(
        MemoryConnection{this, nullptr, twin_, server.loop_, latency, options().unit});
    server.loop_.after(
        0, [&server, there = std::weak_ptr<bool>(server.alive_), connection = connection_] {
          if (!there.expired()) server.accept(connection);
        });
    dialled(true, "");
  });
}

void MemoryLink::send(const RegisterRequest& request) {
  sent_ = twin_.now();
  connection_->server_loop.after(connection_->latency, [connection = connection_, request] {
    if (connection->server != nullptr) connection->server->take(connection, request);
  });
  timeout_timer_ = twin_.after(options().timeout, [this] { lost(late()); });
}

void MemoryLink::on_answer(RegisterAnswer answer) {
  twin_.cancel(timeout_timer_);
  answer.sent = sent_;
  answer.received = twin_.now();
  answered(answer);
}

void MemoryLink::close() {
  twin_.cancel(timeout_timer_);
  const Connection closed = std::move(connection_);
  if (!closed) return;
  closed->link = nullptr;
  closed->server_loop.after(closed->latency, [connection = closed] {
    if (connection->server != nullptr && !connection->state.deaf)
      connection->server->drop(connection);
  });
}

// ---- server ----

MemoryServer::MemoryServer(SimulatedLoop& loop, Options options, RegisterImage& image,
                           Hook before_read, Hook after_write)
    : RegisterServer(loop, std::move(options), image, std::move(before_read),
                     std::move(after_write)),
      loop_(loop) {
  if (!loop.simulation().shared<MemoryServers>().insert({options_.address, this}).second) {
    throw InputError("address " + options_.address + " is served twice");
  }
}

MemoryServer::~MemoryServer() {
  drop_connections();
  loop_.simulation().shared<MemoryServers>().erase(options_.address);
}

void MemoryServer::accept(const Connection& connection) {
  if (connections() >= options_.connections) return drop(connection);
  connection->server = this;
  connection->state.last_received = loop_.now();
  connections_.push_back(connection);
}

void MemoryServer::drop(const Connection& connection) {
  connection->server = nullptr;
  std::erase(connections_, connection);
  connection->link_loop.after(connection->latency, [connection] {
    if (connection->link != nullptr) connection->link->lost("the device closed the connection");
  });
}

void MemoryServer::drop_connection(int n) {
  const Connection connection = connections_.at(static_cast<std::size_t>(n));
  drop(connection);
}

void MemoryServer::take(const Connection& from, const RegisterRequest& request) {
  if (from->state.deaf) return;
  from->state.last_received = loop_.now();
  if (faults_.silent) return;
  if (faults_.garbage) {
    from->link_loop.after(from->latency, [from] {
      if (from->link != nullptr) from->link->lost("the device sent bytes that are not Modbus");
    });
    return;
  }
  if (faults_.delay == 0) return answer(from, request);
  loop_.after(faults_.delay, [from, request] {
    if (from->server != nullptr) from->server->answer(from, request);
  });
}

void MemoryServer::answer(const Connection& to, const RegisterRequest& request) {
  RegisterAnswer answer;
  const RegisterTable table = table_of(request.kind);
  const int exception = !is_addressed_by(to->unit) ? int{MODBUS_EXCEPTION_GATEWAY_TARGET}
                        : faults_.exception != 0   ? faults_.exception
                        : image_.holds(table, request.first, request.count)
                            ? 0
                            : int{MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS};
  if (exception != 0) {
    answer.refuse(exception);
  } else {
    carry_out(request, table, answer);
  }
  to->link_loop.after(to->latency, [to, answer] {
    if (to->link != nullptr) to->link->on_answer(answer);
  });
}

void MemoryServer::carry_out(const RegisterRequest& request, RegisterTable table,
                             RegisterAnswer& answer) {
  using Kind = RegisterRequest::Kind;
  const auto [kind, first, count, words, on] = request;
  const bool writes = kind == Kind::write_registers || kind == Kind::write_coil;
  if (!writes && before_read_) before_read_(table, first, count);
  const auto holding = image_.holding(first, table == RegisterTable::registers ? count : 0);
  switch (kind) {
    case Kind::read_registers:
      answer.words.assign(holding.begin(), holding.end());
      break;
    case Kind::read_coils:
    case Kind::read_inputs:
      for (int n = first; n < first + count; ++n) {
        answer.bits.push_back(kind == Kind::read_coils ? image_.coil(n) : image_.input(n));
      }
      break;
    case Kind::write_registers:
      std::copy(words.begin(), words.end(), holding.begin());
      break;
    case Kind::write_coil:
      image_.set_coil(first, on);
      break;
  }
  if (writes && after_write_) after_write_(table, first, count);
}

}  // namespace berth
