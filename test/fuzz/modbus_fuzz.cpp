// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "common/bus/worker.h"
#include "drivers/modbus/modbus_client.h"
#include "drivers/modbus/modbus_server.h"

using namespace berth;

namespace {

/// The far end of a wire, which the fuzzer holds.
struct FarEnd {
  std::vector<std::uint8_t> sent;  // to the near end
  std::size_t read = 0;            // by it
  std::vector<std::uint8_t> heard;
  Wire::Readable readable;
};

class NearEnd final : public Wire {
 public:
  explicit NearEnd(FarEnd& far) : far_(far) {}
  ~NearEnd() override { far_.readable = nullptr; }
  std::optional<std::size_t> read(std::span<std::uint8_t> into) override {
    const std::size_t size = std::min(into.size(), far_.sent.size() - far_.read);
    std::copy_n(far_.sent.begin() + static_cast<std::ptrdiff_t>(far_.read), size, into.begin());
    far_.read += size;
    return size;
  }
  std::optional<std::size_t> write(std::span<const std::uint8_t> bytes) override {
    far_.heard.insert(far_.heard.end(), bytes.begin(), bytes.end());
    return bytes.size();
  }
  void watch(Readable readable) override { far_.readable = std::move(readable); }
  void unwatch() override { far_.readable = nullptr; }

 private:
  FarEnd& far_;
};

/// Whoever dials or listens is joined to the fuzzer at once; no timer ever fires.
class StillLoop final : public Loop, private Wires {
 public:
  Utime now() const override { return 0; }
  TimerId at(Utime, Task) override { return ++timers_; }
  TimerId every(Utime, Task) override { return ++timers_; }
  void cancel(TimerId) override {}
  Wires& wires() override { return *this; }
  std::unique_ptr<Worker> make_worker() override { return nullptr; }

  FarEnd far;

 private:
  void dial(const std::string&, Connected connected, std::int64_t) override {
    connected(std::make_unique<NearEnd>(far));
  }
  void listen(const std::string&, Connected accepted) override {
    accepted(std::make_unique<NearEnd>(far));
  }
  TimerId timers_ = 0;
};

/// Sends the bytes in pieces of the size in the first one.
void feed(FarEnd& far, const std::uint8_t* data, std::size_t size) {
  const std::size_t piece = data[0] + std::size_t{1};
  for (std::size_t i = 1; i < size; i += piece) {
    far.sent.insert(far.sent.end(), data + i, data + i + std::min(piece, size - i));
    if (!far.readable) return;  // closed
    const Wire::Readable readable = far.readable;
    readable();
  }
}

void fuzz_server(const std::uint8_t* data, std::size_t size) {
  StillLoop loop;
  ModbusImage image(200, 40, 40);
  const auto check = [](ModbusTable table, int first, int count) {
    if (first < 1 || first + count - 1 > (table == ModbusTable::registers ? 200 : 40)) std::abort();
  };
  ModbusServer server(loop, {"a:1", 1, 1, second}, image, check, check);
  feed(loop.far, data, size);
  // Every answer is a sound frame.
  const std::vector<std::uint8_t>& bytes = loop.far.heard;
  for (std::size_t i = 0; i < bytes.size();) {
    if (bytes.size() - i < 8) std::abort();
    const std::size_t length = static_cast<std::size_t>(bytes[i + 4]) << 8 | bytes[i + 5];
    if (length < 3 || length > 254 || i + 6 + length > bytes.size()) std::abort();
    i += 6 + length;
  }
}

void fuzz_client(const std::uint8_t* data, std::size_t size) {
  StillLoop loop;
  ModbusClient client(loop, {"a:1"}, nullptr);
  int answers = 0;
  client.read_registers(1, 3, [&](const ModbusAnswer& answer) {
    ++answers;
    if (answer.ok() && answer.words.size() != 3) std::abort();
  });
  client.read_coils(1, 9, [&](const ModbusAnswer& answer) {
    ++answers;
    if (answer.ok() && answer.bits.size() != 9) std::abort();
  });
  feed(loop.far, data, size);
  if (answers > 2) std::abort();
}

}  // namespace

/// First byte even: the rest is what a client sends to the server. Odd: what a device answers.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 3 || size > 4096) return 0;
  (data[0] % 2 == 0 ? fuzz_server : fuzz_client)(data + 1, size - 1);
  return 0;
}
