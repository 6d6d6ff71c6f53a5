// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/registers/register_server.h"

#include "common/bus/process_loop.h"
#include "common/bus/simulation.h"
#include "drivers/registers/memory_link.h"
#include "drivers/registers/modbus_tcp.h"

namespace berth {

std::unique_ptr<RegisterServer> serve_registers(Loop& loop, RegisterServer::Options options,
                                                RegisterImage& image,
                                                RegisterServer::Hook before_read,
                                                RegisterServer::Hook after_write) {
  if (auto* twin = dynamic_cast<SimulatedLoop*>(&loop)) {
    return std::make_unique<MemoryServer>(*twin, std::move(options), image, std::move(before_read),
                                          std::move(after_write));
  }
  return std::make_unique<ModbusTcpServer>(dynamic_cast<ProcessLoop&>(loop), std::move(options),
                                           image, std::move(before_read), std::move(after_write));
}

}  // namespace berth
