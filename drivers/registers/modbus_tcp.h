// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <modbus/modbus.h>
#include <sched.h>

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <new>
#include <span>
#include <thread>
#include <vector>

#include "common/bus/loop.h"
#include "common/bus/worker.h"
#include "drivers/registers/register_link.h"
#include "drivers/registers/register_server.h"

namespace berth {

struct ModbusFree {
  void operator()(modbus_t* modbus) const {
    modbus_close(modbus);
    modbus_free(modbus);
  }
};

/// libmodbus on a connected socket, which it owns: closed with it.
using ModbusContext = std::unique_ptr<modbus_t, ModbusFree>;

/// response_timeout: of a client, for the whole answer (there is no time-out per byte). A server
/// sleeps for it before the exceptions 1 and 3.
inline ModbusContext make_modbus_context(int fd, int unit, Utime response_timeout) {
  ModbusContext modbus(modbus_new_tcp("0.0.0.0", 502));  // never dialled
  if (!modbus) throw std::bad_alloc();
  modbus_set_socket(modbus.get(), fd);
  modbus_set_slave(modbus.get(), unit);
  modbus_set_response_timeout(modbus.get(), static_cast<std::uint32_t>(response_timeout / second),
                              static_cast<std::uint32_t>(response_timeout % second));
  modbus_set_byte_timeout(modbus.get(), 0, 0);
  return modbus;
}

/// A real-time process (process_host) resets the priority of threads that it starts; the threads of
/// device traffic restore it.
class ThreadPriority {
 public:
  /// Of the calling thread.
  ThreadPriority() : policy_(sched_getscheduler(0)) { sched_getparam(0, &parameter_); }
  /// Applies it to the calling thread; without effect where the system forbids it.
  void take() const { sched_setscheduler(0, policy_, &parameter_); }

 private:
  int policy_;
  sched_param parameter_{};
};

class ProcessLoop;

/// Modbus TCP by libmodbus, which waits for its answers on a worker of the link's own. Transaction,
/// function, size and count of an answer are checked there; its unit and the coil or register that
/// a write's answer names are not: libmodbus does not return them.
class ModbusTcpLink final : public RegisterLink {
 public:
  ModbusTcpLink(ProcessLoop& loop, Options options, ConnectionChanged changed);
  ~ModbusTcpLink() override;

 private:
  void dial() override;
  void send(const RegisterRequest& request) override;
  void close() override;

  ProcessLoop& loop_;
  ModbusContext modbus_;  // the worker's from send() until its answer; null: not connected
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::unique_ptr<Worker> worker_;
};

class ProcessLoop;
class Socket;

/// The registers or bits that a request accesses, or the exception that answers it.
struct RegisterAccess {
  RegisterTable table = RegisterTable::registers;
  bool writes = false;
  int first = 0;  ///< from 1
  int count = 0;
  int exception = 0;
};

/// Of a request, as modbus_receive gives it: functions 1, 2, 3, 5, 6, 15 and 16 (MODBUS Application
/// Protocol Specification V1.1b3, section 6).
RegisterAccess access_of(std::span<const std::uint8_t> request, const RegisterImage& image);

/// Modbus TCP by libmodbus' server side: a thread a connection waits for its requests, one by one,
/// and each is carried out and answered on the loop. A client that sends anything but Modbus, or
/// does not read, is disconnected.
class ModbusTcpServer final : public RegisterServer {
 public:
  /// @throws InputError when the address cannot be listened on.
  ModbusTcpServer(ProcessLoop& loop, Options options, RegisterImage& image, Hook before_read,
                  Hook after_write);
  ~ModbusTcpServer() override;

  int connections() const override { return static_cast<int>(connections_.size()); }
  void drop_connection(int n) override { drop(connections_.at(static_cast<std::size_t>(n))->id); }
  /// Takes over a connected socket as if it had been dialled.
  void accept(Socket socket);

 private:
  using Request = std::vector<std::uint8_t>;
  struct Connection {
    std::uint64_t id = 0;
    ModbusContext modbus;  // the thread's while it waits for a request, else the loop's
    ConnectionState state;
    bool answered = false;  // guarded by mutex_
    bool ends = false;      // guarded by mutex_
    std::thread thread;
  };

  ConnectionState& state(int n) override {
    return connections_.at(static_cast<std::size_t>(n))->state;
  }
  void receive(Connection& connection);  // the thread
  void post(std::uint64_t id, std::function<void(Connection&)> task);
  Connection* connection(std::uint64_t id);
  void take(Connection& from, const Request& request);
  void answer(Connection& to, const Request& request);
  bool send_garbage(const Connection& to) const;
  /// The thread waits for the next request.
  void go_on(Connection& connection);
  void drop(std::uint64_t id);

  ProcessLoop& loop_;
  std::vector<std::unique_ptr<Connection>> connections_;
  std::uint64_t last_id_ = 0;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
};

}  // namespace berth
