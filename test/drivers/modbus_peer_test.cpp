// SPDX-License-Identifier: BSD-3-Clause
// Our client and server against libmodbus', over real TCP.
#include <modbus/modbus.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <optional>
#include <thread>

#include "common/bus/process_loop.h"
#include "drivers/modbus/modbus_client.h"
#include "drivers/modbus/modbus_server.h"
#include "test/catch.h"
#include "test/free_port.h"

namespace berth {
namespace {

using Peer = std::unique_ptr<modbus_t, void (*)(modbus_t*)>;

Peer make_peer(int port) {
  Peer peer(modbus_new_tcp("127.0.0.1", port), modbus_free);
  REQUIRE(peer);
  return peer;
}

TEST_CASE("libmodbus reads and writes what our server shows") {
  ProcessLoop loop(clock_offset_now());
  const int port = free_port();
  ModbusImage image(50, 20, 20);
  image.holding(7) = 0x1234;
  image.set_coil(3, true);
  image.set_input(10, true);
  ModbusServer server(loop, {"127.0.0.1:" + std::to_string(port)}, image, nullptr, nullptr);

  std::array<int, 9> results{};
  std::array<std::uint16_t, 3> words{};
  std::array<std::uint8_t, 20> coils{};
  std::array<std::uint8_t, 12> inputs{};
  int refused = 0;
  std::thread asking([&] {
    const Peer peer = make_peer(port);
    modbus_t* const m = peer.get();
    modbus_set_slave(m, 1);
    modbus_set_response_timeout(m, 20, 0);
    results[0] = modbus_connect(m);
    results[1] = modbus_read_registers(m, 5, 3, words.data());
    const std::array<std::uint16_t, 2> two{11, 0xffff};
    results[2] = modbus_write_registers(m, 20, 2, two.data());
    results[3] = modbus_write_register(m, 30, 77);
    results[4] = modbus_write_bit(m, 4, 1);
    const std::array<std::uint8_t, 10> ten{1, 0, 1, 0, 1, 0, 1, 0, 1, 1};
    results[5] = modbus_write_bits(m, 10, 10, ten.data());
    results[6] = modbus_read_bits(m, 0, 20, coils.data());
    results[7] = modbus_read_input_bits(m, 4, 12, inputs.data());
    results[8] = modbus_read_registers(m, 49, 2, words.data());  // one beyond the last
    refused = errno;
    loop.stop();
  });
  loop.run();
  asking.join();

  CHECK(results == std::array{0, 3, 2, 1, 1, 10, 20, 12, -1});
  CHECK(refused == EMBXILADD);
  CHECK(words == std::array<std::uint16_t, 3>{0, 0x1234, 0});
  CHECK(image.holding(21) == 11);
  CHECK(image.holding(22) == 0xffff);
  CHECK(image.holding(31) == 77);
  CHECK(coils ==
        std::array<std::uint8_t, 20>{0, 0, 1, 0, 1, 0, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 1});
  CHECK(inputs == std::array<std::uint8_t, 12>{0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0});
}

TEST_CASE("our client reads and writes what libmodbus serves") {
  ProcessLoop loop(clock_offset_now());
  const int port = free_port();
  const Peer peer = make_peer(port);
  std::unique_ptr<modbus_mapping_t, void (*)(modbus_mapping_t*)> shown(
      modbus_mapping_new(20, 20, 50, 0), modbus_mapping_free);
  shown->tab_registers[6] = 0x1234;
  shown->tab_bits[2] = 1;
  shown->tab_input_bits[9] = 1;
  int listening = modbus_tcp_listen(peer.get(), 1);
  REQUIRE(listening >= 0);
  std::thread serving([&] {
    modbus_tcp_accept(peer.get(), &listening);
    std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> query{};
    int size = 0;
    while ((size = modbus_receive(peer.get(), query.data())) >= 0) {
      if (size > 0) modbus_reply(peer.get(), query.data(), size, shown.get());
    }
  });

  std::vector<Word> words;
  std::vector<std::uint8_t> coils, inputs;
  std::vector<std::string> errors;
  std::optional<ModbusClient> client;
  const auto keep = [&](const ModbusAnswer& answer) { errors.push_back(answer.error); };
  client.emplace(loop, ModbusClient::Options{"127.0.0.1:" + std::to_string(port), 1, 20 * second},
                 [&](bool up, const std::string&) {
                   if (!up) return;
                   const std::array<Word, 2> two{11, 0xffff};
                   client->write_registers(21, two, keep);
                   client->write_coil(5, true, keep);
                   client->read_registers(6, 17, [&](const ModbusAnswer& answer) {
                     keep(answer);
                     words.assign(answer.words.begin(), answer.words.end());
                   });
                   client->read_coils(1, 20, [&](const ModbusAnswer& answer) {
                     keep(answer);
                     coils.assign(answer.bits.begin(), answer.bits.end());
                   });
                   client->read_inputs(10, 1, [&](const ModbusAnswer& answer) {
                     keep(answer);
                     inputs.assign(answer.bits.begin(), answer.bits.end());
                   });
                   client->read_registers(50, 2, [&](const ModbusAnswer& answer) {
                     keep(answer);
                     loop.stop();
                   });
                 });
  loop.run();
  client.reset();  // which ends the other's connection
  serving.join();
  close(listening);

  CHECK(errors == std::vector<std::string>{"", "", "", "", "", "refused: Illegal data address"});
  REQUIRE(words.size() == 17);
  CHECK(words[1] == 0x1234);
  CHECK(words[15] == 11);
  CHECK(words[16] == 0xffff);
  REQUIRE(coils.size() == 20);
  CHECK(coils[2] == 1);
  CHECK(coils[4] == 1);
  CHECK(coils[3] == 0);
  CHECK(inputs == std::vector<std::uint8_t>{1});
}

}  // namespace
}  // namespace berth
