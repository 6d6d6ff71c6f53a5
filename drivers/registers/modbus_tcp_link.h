// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "common/bus/worker.h"
#include "drivers/registers/modbus_context.h"
#include "drivers/registers/register_link.h"

namespace berth {

class ProcessLoop;

/// Modbus TCP by libmodbus, which waits for its answers on a worker of the link's own. Transaction,
/// function, size and count of an answer are checked there; its unit and the coil or register that
/// a write's answer names are not: libmodbus shows them to nobody.
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

}  // namespace berth
