// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/connection.h"

#include "common/bus/process_loop.h"
#include "common/bus/simulation.h"
#include "drivers/lidar/memory_connection.h"
#include "drivers/lidar/tcp_connection.h"

namespace berth::lidar {

void dial(Loop& loop, const std::string& address, Connected connected, Utime timeout) {
  if (auto* twin = dynamic_cast<SimulatedLoop*>(&loop)) {
    return dial_memory(*twin, address, std::move(connected));
  }
  auto& process = dynamic_cast<ProcessLoop&>(loop);
  process.sockets().dial(
      address,
      [&process, address, connected = std::move(connected)](Socket socket) {
        if (socket.fd() < 0) return connected(nullptr, process.sockets().trouble(address));
        connected(std::make_unique<TcpConnection>(process, std::move(socket)), "");
      },
      timeout);
}

void listen(Loop& loop, const std::string& address, Accepted accepted) {
  if (auto* twin = dynamic_cast<SimulatedLoop*>(&loop)) {
    return listen_memory(*twin, address, std::move(accepted));
  }
  auto& process = dynamic_cast<ProcessLoop&>(loop);
  process.sockets().listen(address, [&process, accepted = std::move(accepted)](Socket socket) {
    accepted(std::make_unique<TcpConnection>(process, std::move(socket)));
  });
}

}  // namespace berth::lidar
