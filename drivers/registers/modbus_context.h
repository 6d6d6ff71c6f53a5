// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <modbus/modbus.h>
#include <sched.h>

#include <cstdint>
#include <memory>
#include <new>

#include "common/bus/loop.h"

namespace berth {

struct ModbusFree {
  void operator()(modbus_t* modbus) const {
    modbus_close(modbus);
    modbus_free(modbus);
  }
};

/// libmodbus on a connected socket, which it owns: closed with it.
using ModbusContext = std::unique_ptr<modbus_t, ModbusFree>;

/// response_timeout: of a client, the whole answer's: no byte's own one re-arms it. A server sleeps
/// for it before the exceptions 1 and 3.
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

/// A real-time process (process_host) resets the priority of threads that it starts; those that
/// carry its device's traffic take it over again.
class ThreadPriority {
 public:
  /// Of the calling thread.
  ThreadPriority() : policy_(sched_getscheduler(0)) { sched_getparam(0, &parameter_); }
  /// Gives it to the calling thread; without effect where the system does not let it.
  void take() const { sched_setscheduler(0, policy_, &parameter_); }

 private:
  int policy_;
  sched_param parameter_{};
};

}  // namespace berth
