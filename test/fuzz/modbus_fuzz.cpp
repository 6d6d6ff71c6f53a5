// SPDX-License-Identifier: BSD-3-Clause
// Registers over libmodbus: requests of any bytes to the server, answers of any bytes to a link.
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "common/bus/process_loop.h"
#include "common/bus/sockets.h"
#include "drivers/registers/modbus_tcp.h"

using namespace berth;

namespace {

constexpr const char* device = "127.0.0.1:50299";
constexpr const char* server_address = "127.0.0.1:50298";  // never dialled

void run_until(ProcessLoop& loop, const std::function<bool()>& done) {
  while (!done()) {
    loop.after(100, [&] { loop.stop(); });
    loop.run();
  }
}

void fuzz_server(const std::uint8_t* data, std::size_t size) {
  static ProcessLoop loop(0);
  static RegisterImage image(200, 40, 40);
  const auto check = [](RegisterTable table, int first, int count) {
    if (!image.holds(table, first, count)) std::abort();
  };
  static ModbusTcpServer server(loop, {server_address, 1, 1, second}, image, check, check);

  std::array<int, 2> pair{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pair.data()) != 0) std::abort();
  server.accept(Socket(pair[0]));
  const Socket peer(pair[1]);
  if (write(peer.fd(), data, size) != static_cast<ssize_t>(size)) std::abort();
  shutdown(peer.fd(), SHUT_WR);
  run_until(loop, [] { return server.connections() == 0; });

  // Every answer is a sound frame.
  std::vector<std::uint8_t> received(1 << 20);
  const ssize_t got = recv(peer.fd(), received.data(), received.size(), MSG_DONTWAIT);
  received.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  for (std::size_t i = 0; i < received.size();) {
    if (received.size() - i < 9) std::abort();
    const std::size_t length = static_cast<std::size_t>(received[i + 4]) << 8 | received[i + 5];
    if (length < 3 || length > 254 || i + 6 + length > received.size()) std::abort();
    i += 6 + length;
  }
}

void fuzz_link(const std::uint8_t* data, std::size_t size) {
  static ProcessLoop loop(0);
  static std::vector<std::uint8_t> answer;
  static const bool is_listening = [] {
    loop.sockets().listen(device, [](const Socket& socket) { socket.write(answer); });
    return true;
  }();
  answer.assign(data, data + (is_listening ? size : 0));
  int answers = 0;
  ModbusTcpLink* client = nullptr;
  ModbusTcpLink link(loop, {device, 1, second}, [&](bool up, const std::string&) {
    if (!up) return;
    client->read_registers(1, 3, [&](const RegisterAnswer& given) {
      ++answers;
      if (given.ok() && given.words.size() != 3) std::abort();
    });
    client->read_coils(1, 9, [&](const RegisterAnswer& given) {
      ++answers;
      if (given.ok() && given.bits.size() != 9) std::abort();
    });
  });
  client = &link;
  run_until(loop, [&] { return answers >= 2; });
}

}  // namespace

/// First byte even: the rest is what a client sends to the server. Odd: what a device answers.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2 || size > 4096) return 0;
  (data[0] % 2 == 0 ? fuzz_server : fuzz_link)(data + 1, size - 1);
  return 0;
}
