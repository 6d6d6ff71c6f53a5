// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/bus/process_loop.h"
#include "common/bus/wire.h"

namespace berth {

/// Real TCP sockets on a ProcessLoop, which must outlive them and their wires.
class TcpWires final : public Wires {
 public:
  explicit TcpWires(ProcessLoop& loop) : loop_(loop) {}
  ~TcpWires() override;
  TcpWires(const TcpWires&) = delete;
  TcpWires& operator=(const TcpWires&) = delete;

  void dial(const std::string& address, Connected connected) override;
  void listen(const std::string& address, Connected accepted) override;

 private:
  ProcessLoop& loop_;
  std::vector<int> listening_;
};

}  // namespace berth
