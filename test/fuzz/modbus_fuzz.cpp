// SPDX-License-Identifier: BSD-3-Clause
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <vector>

#include "drivers/modbus/modbus_client.h"
#include "drivers/modbus/modbus_server.h"

using namespace berth;

namespace {

/// Descriptors become readable when the fuzzer says so; no timer ever fires.
class StillLoop final : public Loop {
 public:
  Utime now() const override { return 0; }
  TimerId at(Utime, Task) override { return ++timers_; }
  TimerId every(Utime, Task) override { return ++timers_; }
  void cancel(TimerId) override {}
  void watch(int fd, Task readable) override { tasks_[fd] = std::move(readable); }
  void unwatch(int fd) override { tasks_.erase(fd); }
  /// @return false when nobody watches it any more.
  bool wake(int fd) {
    const auto found = tasks_.find(fd);
    if (found == tasks_.end()) return false;
    const Task task = found->second;
    task();
    return tasks_.contains(fd);
  }

 private:
  TimerId timers_ = 0;
  std::map<int, Task> tasks_;
};

/// One socket pair: the near end goes to the part under test, the far end is ours.
class PairWires final : public Wires {
 public:
  PairWires() {
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) != 0) std::abort();
  }
  ~PairWires() override { close(ends[1]); }
  void dial(const std::string&, Connected connected) override { connected(ends[0]); }
  void listen(const std::string&, Connected accepted) override { accepted(ends[0]); }
  int ends[2];
};

/// Sends the bytes in pieces of the size in the first one.
void feed(StillLoop& loop, const PairWires& wires, const std::uint8_t* data, std::size_t size) {
  const std::size_t piece = data[0] + std::size_t{1};
  for (std::size_t i = 1; i < size; i += piece) {
    if (send(wires.ends[1], data + i, std::min(piece, size - i), MSG_NOSIGNAL) < 0) return;
    if (!loop.wake(wires.ends[0])) return;
  }
}

void fuzz_server(const std::uint8_t* data, std::size_t size) {
  StillLoop loop;
  PairWires wires;
  ModbusImage image(200, 40, 40);
  const auto check = [](ModbusTable table, int first, int count) {
    if (first < 1 || first + count - 1 > (table == ModbusTable::registers ? 200 : 40)) std::abort();
  };
  ModbusServer server(loop, wires, {"a:1", 1, 1, second}, image, check, check);
  feed(loop, wires, data, size);
  // Every answer is a sound frame.
  std::vector<std::uint8_t> bytes(1 << 16);
  const ssize_t got = recv(wires.ends[1], bytes.data(), bytes.size(), MSG_DONTWAIT);
  for (ssize_t i = 0; i < got;) {
    if (got - i < 8) std::abort();
    const ssize_t length =
        bytes[static_cast<std::size_t>(i + 4)] << 8 | bytes[static_cast<std::size_t>(i + 5)];
    if (length < 3 || length > 254 || i + 6 + length > got) std::abort();
    i += 6 + length;
  }
}

void fuzz_client(const std::uint8_t* data, std::size_t size) {
  StillLoop loop;
  PairWires wires;
  ModbusClient client(loop, wires, {"a:1"}, nullptr);
  int answers = 0;
  client.read_registers(1, 3, [&](const ModbusAnswer& answer) {
    ++answers;
    if (answer.ok() && answer.words.size() != 3) std::abort();
  });
  client.read_coils(1, 9, [&](const ModbusAnswer& answer) {
    ++answers;
    if (answer.ok() && answer.bits.size() != 9) std::abort();
  });
  feed(loop, wires, data, size);
  if (answers > 2) std::abort();
}

}  // namespace

/// First byte even: the rest is what a client sends to the server. Odd: what a device answers.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3 || size > 4096) return 0;
  (data[0] % 2 == 0 ? fuzz_server : fuzz_client)(data + 1, size - 1);
  return 0;
}
