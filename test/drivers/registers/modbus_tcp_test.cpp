// SPDX-License-Identifier: BSD-3-Clause
// Registers over real TCP: libmodbus on both sides, and peers whose every byte the test chooses.
#include <modbus/modbus.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <thread>

#include "common/bus/process_loop.h"
#include "drivers/registers/register_link.h"
#include "drivers/registers/register_server.h"
#include "drivers/registers/words.h"
#include "test/catch.h"
#include "test/free_port.h"
#include "test/run_until.h"

namespace berth {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// A loop, and what is joined over it: a link, a server or bytes in the place of either.
struct Rig {
  void serve(int limit = 4, Utime idle_timeout = 60 * second) {
    server = serve_registers(
        loop, {address, 1, limit, idle_timeout}, image,
        [this](RegisterTable table, int first, int count) { check(table, first, count); },
        [this](RegisterTable table, int first, int count) {
          check(table, first, count);
          ++writes;
        });
  }
  void check(RegisterTable table, int first, int count) const {
    if (!image.holds(table, first, count)) throw std::logic_error("beyond the image");
  }
  void connect(Utime timeout = 20 * second, int unit = 1) {
    link =
        make_register_link(loop, {address, unit, timeout}, [this](bool up, const std::string& why) {
          up ? ++connections : ++losses;
          reason = why;
        });
    REQUIRE(run_until([this] { return link->connected(); }));
  }
  RegisterLink::Done keep() {
    return [this](const RegisterAnswer& given) {
      ++answers;
      answer = given;
    };
  }
  /// The answer to a read of two registers.
  std::string read_two_registers() {
    const int before = answers;
    link->read_registers(7, 2, keep());
    REQUIRE(run_until([&] { return answers > before; }));
    return answer.error;
  }
  /// A device that answers every request with these bytes, piece by piece.
  void answer_with(std::vector<Bytes> pieces, Utime pause = 0) {
    loop.sockets().listen(address, [this, pieces, pause](Socket accepted) {
      peer = std::move(accepted);
      loop.watch(peer.fd(), [this, pieces, pause] {
        std::array<std::uint8_t, 300> request;
        if (!peer.read(request) || pieces.empty()) return hang_up();
        Utime delay = 0;
        for (const Bytes& piece : pieces) {
          loop.after(delay += pause, [this, piece] {
            if (peer.fd() >= 0) peer.write(piece);
          });
        }
      });
    });
  }
  /// Dials the server with these bytes; what comes back is in received.
  void send(const Bytes& bytes) {
    loop.sockets().dial(address, [this, bytes](Socket dialled) {
      REQUIRE(dialled.fd() >= 0);
      peer = std::move(dialled);
      REQUIRE(peer.write(bytes) == bytes.size());
      loop.watch(peer.fd(), [this] {
        std::array<std::uint8_t, 300> piece;
        const auto size = peer.read(piece);
        if (!size) {
          closed = true;
          return hang_up();
        }
        received.insert(received.end(), piece.begin(),
                        piece.begin() + static_cast<std::ptrdiff_t>(*size));
      });
    });
  }
  void hang_up() {
    loop.unwatch(peer.fd());
    peer = Socket();
  }
  bool run_until(const std::function<bool()>& done) { return berth::run_until(loop, done); }

  ProcessLoop loop{clock_offset_now()};
  std::string address = free_address();
  RegisterImage image{200, 20, 20};
  std::unique_ptr<RegisterServer> server;
  std::unique_ptr<RegisterLink> link;
  Socket peer;
  Bytes received;
  bool closed = false;
  int connections = 0;
  int losses = 0;
  int writes = 0;
  std::string reason;
  int answers = 0;
  RegisterAnswer answer;
};

TEST_CASE("a link carries every kind of request to a server, 125 registers at once") {
  Rig rig;
  rig.serve();
  rig.connect();
  rig.image.holding(7) = 0x1234;
  rig.image.holding(125) = 0xfffe;
  rig.image.set_input(10, true);
  std::vector<RegisterAnswer> answers;
  const auto keep = [&](const RegisterAnswer& answer) { answers.push_back(answer); };
  const std::array<Word, 2> two{11, 0xffff};
  rig.link->write_registers(21, two, keep);
  rig.link->write_coil(5, true, keep);
  rig.link->read_registers(1, 125, keep);
  rig.link->read_coils(1, 20, keep);
  rig.link->read_inputs(10, 2, keep);
  rig.link->read_registers(200, 2, keep);
  rig.link->read_registers(1, 1, keep);
  REQUIRE(rig.run_until([&] { return answers.size() == 7; }));
  CHECK(rig.image.holding(22) == 0xffff);
  CHECK(rig.image.coil(5));
  CHECK(rig.writes == 2);
  REQUIRE(answers[2].words.size() == 125);
  CHECK(answers[2].words[6] == 0x1234);
  CHECK(answers[2].words[20] == 11);
  CHECK(answers[2].words[124] == 0xfffe);
  Bytes coils(20);
  coils[4] = 1;
  CHECK(answers[3].bits == coils);
  CHECK(answers[4].bits == Bytes{1, 0});
  CHECK(answers[5].error == "refused: Illegal data address");
  CHECK(answers[5].exception == MODBUS_EXCEPTION_ILLEGAL_DATA_ADDRESS);
  CHECK(answers[6].ok());  // the connection lives on
  CHECK(answers[2].received >= answers[2].sent);
  CHECK(answers[3].sent >= answers[2].received);
  CHECK(rig.losses == 0);

  // More than Modbus carries is refused before it is sent.
  rig.link->read_registers(1, 126, keep);
  CHECK(answers.back().error == "126 in one request, expected 1 to 125");
}

TEST_CASE("over TCP a device answers to its unit, and behind no gateway to 0 and 255") {
  const auto [unit, error] = GENERATE(table<int, std::string>(
      {{0, ""}, {255, ""}, {2, "refused: Target device failed to respond"}}));
  Rig rig;
  rig.serve();
  rig.connect(20 * second, unit);
  CHECK(rig.read_two_registers() == error);
  CHECK(rig.losses == 0);
}

TEST_CASE("libmodbus' own client reads and writes what the server shows") {
  Rig rig;
  rig.image.holding(7) = 0x1234;
  rig.image.set_coil(3, true);
  rig.serve();
  std::array<int, 7> results{};
  std::array<std::uint16_t, 3> words{};
  std::array<std::uint8_t, 20> coils{};
  int refused = 0;
  std::thread client([&] {
    const std::string port = rig.address.substr(rig.address.find(':') + 1);
    const std::unique_ptr<modbus_t, void (*)(modbus_t*)> peer(
        modbus_new_tcp("127.0.0.1", std::stoi(port)), modbus_free);
    modbus_t* const m = peer.get();
    modbus_set_slave(m, 1);
    modbus_set_response_timeout(m, 20, 0);
    results[0] = modbus_connect(m);
    results[1] = modbus_read_registers(m, 5, 3, words.data());
    results[2] = modbus_write_register(m, 30, 77);
    const std::array<std::uint8_t, 10> ten{1, 0, 1, 0, 1, 0, 1, 0, 1, 1};
    results[3] = modbus_write_bits(m, 10, 10, ten.data());
    results[4] = modbus_read_bits(m, 0, 20, coils.data());
    results[5] = modbus_read_input_registers(m, 0, 1, words.data());  // function 4 is not served
    refused = errno;
    results[6] = modbus_read_registers(m, 5, 3, words.data());
    modbus_close(m);
    rig.loop.stop();
  });
  rig.loop.run();
  client.join();
  CHECK(results == std::array{0, 3, 1, 10, 20, -1, 3});
  CHECK(refused == EMBXILFUN);
  CHECK(words == std::array<std::uint16_t, 3>{0, 0x1234, 0});
  CHECK(rig.image.holding(31) == 77);
  CHECK(coils ==
        std::array<std::uint8_t, 20>{0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 1});
}

/// What mbpoll, a Modbus client of others, prints when it is run with these options and values.
std::string mbpoll(Rig& rig, const std::string& options) {
  const std::string port = rig.address.substr(rig.address.find(':') + 1);
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(
      popen(("mbpoll -m tcp -a 1 -1 -q -p " + port + " 127.0.0.1 " + options + " 2>&1").c_str(),
            "r"),
      pclose);
  const int fd = fileno(pipe.get());
  std::string printed;
  bool ended = false;
  rig.loop.watch(fd, [&] {
    std::array<char, 300> piece;
    const ssize_t size = read(fd, piece.data(), piece.size());
    if (size > 0) return void(printed.append(piece.data(), static_cast<std::size_t>(size)));
    rig.loop.unwatch(fd);
    ended = true;
  });
  REQUIRE(rig.run_until([&] { return ended; }));
  return printed;
}

TEST_CASE("mbpoll reads and writes what the server shows") {
  if (std::system("command -v mbpoll >/dev/null") != 0) {
    WARN("skipped: no mbpoll here");
    return;
  }
  Rig rig;
  rig.serve();
  rig.image.holding(7) = 0x1234;
  put_float(-1341.5F, rig.image.holding(41, 2).data());
  rig.image.set_input(10, true);
  using Catch::Contains;
  CHECK_THAT(mbpoll(rig, "-r 6 -c 3 -t 4:hex"),
             Contains("[6]: \t0x0000") && Contains("[7]: \t0x1234") && Contains("[8]: \t0x0000"));
  CHECK_THAT(mbpoll(rig, "-r 41 -t 4:float"), Contains("[41]: \t-1341.5"));
  CHECK_THAT(mbpoll(rig, "-r 9 -c 2 -t 1"), Contains("[9]: \t0") && Contains("[10]: \t1"));
  CHECK_THAT(mbpoll(rig, "-r 76 -c 125 -t 4"), Contains("[200]: \t0"));
  CHECK_THAT(mbpoll(rig, "-r 3 -t 0 1 0 1"), Contains("Written 3 references."));
  CHECK((rig.image.coil(3) && !rig.image.coil(4) && rig.image.coil(5)));
  CHECK_THAT(mbpoll(rig, "-r 51 -t 4:float 23.625"), Contains("Written 1 references."));
  CHECK(get_float(rig.image.holding(51, 2).data()) == 23.625F);
  CHECK_THAT(mbpoll(rig, "-r 201"), Contains("Illegal data address"));
  CHECK_THAT(mbpoll(rig, "-r 7 -t 3"), Contains("Illegal function"));  // input registers
}

/// The answer of unit 1 to the first request of a connection, for two registers.
const Bytes good{0, 1, 0, 0, 0, 7, 1, 3, 4, 0x12, 0x34, 0, 1};

TEST_CASE("an answer in single bytes is put together") {
  Rig rig;
  std::vector<Bytes> bytes;
  for (const std::uint8_t byte : good) bytes.push_back({byte});
  rig.answer_with(bytes, millisecond);
  rig.connect();
  CHECK(rig.read_two_registers().empty());
  CHECK(rig.answer.words == std::vector<Word>{0x1234, 1});
  CHECK(rig.losses == 0);
}

TEST_CASE("an answer that is none to the request closes the connection, which is made anew") {
  const auto [at, value] = GENERATE(table<std::size_t, std::uint8_t>({
      {1, 9},  // another transaction
      {7, 4},  // another function
      {8, 2},  // fewer registers than requested
  }));
  CAPTURE(at);
  Bytes spoilt = good;
  spoilt[at] = value;
  Rig rig;
  rig.answer_with({spoilt});
  rig.connect();
  CHECK_THAT(rig.read_two_registers(),
             Catch::StartsWith("the device sent no answer to the request"));
  CHECK(rig.losses == 1);
  CHECK(rig.run_until([&] { return rig.connections == 2; }));
}

TEST_CASE("bytes that are no Modbus close the connection") {
  Rig rig;
  rig.answer_with({Bytes(300, 0xa5)});
  rig.connect();
  CHECK_THAT(rig.read_two_registers(),
             Catch::StartsWith("the device sent no answer to the request"));
  CHECK(rig.losses == 1);
}

TEST_CASE("given up: the unit of an answer and the coil that it names are not checked") {
  Rig rig;
  SECTION("unit") {
    Bytes other = good;
    other[6] = 9;
    rig.answer_with({other});
    rig.connect();
    CHECK(rig.read_two_registers().empty());
  }
  SECTION("coil") {
    rig.answer_with({{0, 1, 0, 0, 0, 6, 1, 5, 0, 9, 0, 0}});  // coil 10 off
    rig.connect();
    rig.link->write_coil(5, true, rig.keep());
    REQUIRE(rig.run_until([&] { return rig.answers == 1; }));
    CHECK(rig.answer.ok());
  }
}

TEST_CASE("the time-out bounds the whole answer, and a late one is taken for no other's") {
  Rig rig;
  SECTION("single bytes, each of them in time") {
    std::vector<Bytes> bytes;
    for (const std::uint8_t byte : good) bytes.push_back({byte});
    rig.answer_with(bytes, 10 * millisecond);
    rig.connect(60 * millisecond);
    CHECK(rig.read_two_registers() == "no answer within 60 ms");
  }
  SECTION("more announced than sent") {
    rig.answer_with({Bytes(good.begin(), good.end() - 1)});
    rig.connect(60 * millisecond);
    CHECK(rig.read_two_registers() == "no answer within 60 ms");
  }
  SECTION("a late answer") {
    rig.answer_with({good}, 90 * millisecond);
    rig.connect(60 * millisecond);
    CHECK(rig.read_two_registers() == "no answer within 60 ms");
    REQUIRE(rig.run_until([&] { return rig.link->connected(); }));
    CHECK(rig.read_two_registers() == "no answer within 60 ms");
  }
  CHECK(rig.losses >= 1);
}

TEST_CASE("a device that closes the connection, and one whose connection is half open") {
  Rig rig;
  SECTION("closed instead of an answer") {
    rig.answer_with({});
    rig.connect();
    CHECK(rig.read_two_registers() == "the device closed the connection");
    CHECK(rig.losses == 1);
  }
  SECTION("closed without a pending request") {
    rig.serve();
    rig.connect();
    REQUIRE(rig.run_until([&] { return rig.server->connections() == 1; }));
    rig.server->drop_connections();
    CHECK(rig.server->connections() == 0);
    CHECK(rig.read_two_registers() == "the device closed the connection");
    REQUIRE(rig.run_until([&] { return rig.link->connected(); }));
    CHECK(rig.read_two_registers().empty());
  }
  SECTION("half open: the dead one holds its place, a new one works") {
    rig.serve();
    rig.connect(60 * millisecond);
    REQUIRE(rig.run_until([&] { return rig.server->connections() == 1; }));
    rig.server->half_open(0);
    CHECK(rig.read_two_registers() == "no answer within 60 ms");
    REQUIRE(rig.run_until([&] { return rig.link->connected(); }));
    CHECK(rig.read_two_registers().empty());
    CHECK(rig.server->connections() == 2);
  }
}

/// A device that takes one request on each connection. The first is answered by the beginning of an
/// answer and a hard reset (TCP's RST), the others as they should be.
class ResettingDevice {
 public:
  explicit ResettingDevice(const std::string& address)
      : listener_(modbus_new_tcp("127.0.0.1", std::stoi(address.substr(address.find(':') + 1)))),
        socket_(modbus_tcp_listen(listener_.get(), 4)),
        thread_([this] { run(); }) {}
  ~ResettingDevice() {
    shutdown(socket_, SHUT_RDWR);
    thread_.join();
    close(socket_);
  }

 private:
  void run() {
    for (bool first = true;; first = false) {
      const int peer = accept(socket_, nullptr, nullptr);
      if (peer < 0) return;
      const timeval limit{10, 0};
      setsockopt(peer, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
      std::array<std::uint8_t, 12> request;
      if (recv(peer, request.data(), request.size(), MSG_WAITALL) > 0) {
        Bytes answer{request[0], request[1], 0, 0, 0, 7, 1, 3, 4, 0, 5, 0, 6};
        if (first) answer.resize(9);
        send(peer, answer.data(), answer.size(), MSG_NOSIGNAL);
      }
      if (first) {
        // The link has the half answer when the reset comes.
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        const linger hard{1, 0};
        setsockopt(peer, SOL_SOCKET, SO_LINGER, &hard, sizeof hard);
      } else {
        std::uint8_t end = 0;
        recv(peer, &end, 1, 0);  // until the link is gone
      }
      close(peer);
    }
  }

  struct Free {
    void operator()(modbus_t* modbus) const { modbus_free(modbus); }
  };
  std::unique_ptr<modbus_t, Free> listener_;
  int socket_;
  std::thread thread_;
};

TEST_CASE("a connection reset in the midst of an answer is named and dialled anew") {
  Rig rig;
  const ResettingDevice device(rig.address);
  rig.connect();
  CHECK(rig.read_two_registers() == "the device closed the connection");
  CHECK(rig.losses == 1);
  CHECK(rig.reason == "the device closed the connection");
  REQUIRE(rig.run_until([&] { return rig.link->connected(); }));
  CHECK(rig.read_two_registers().empty());
  CHECK(rig.answer.words == std::vector<Word>{5, 6});
  CHECK(rig.connections == 2);
  rig.link.reset();
}

TEST_CASE("faults of a device over TCP") {
  Rig rig;
  rig.serve();
  SECTION("exception") {
    rig.connect();
    rig.server->faults().exception = MODBUS_EXCEPTION_SLAVE_OR_SERVER_BUSY;
    CHECK(rig.read_two_registers() == "refused: Slave device or server is busy");
    CHECK(rig.losses == 0);
  }
  SECTION("garbage") {
    rig.connect();
    rig.server->faults().garbage = true;
    CHECK_THAT(rig.read_two_registers(),
               Catch::StartsWith("the device sent no answer to the request"));
  }
  SECTION("late, but in time") {
    rig.connect();
    rig.server->faults().delay = 20 * millisecond;
    CHECK(rig.read_two_registers().empty());
    CHECK(rig.answer.received - rig.answer.sent >= 20 * millisecond);
  }
  SECTION("silent") {
    rig.connect(60 * millisecond);
    rig.server->faults().silent = true;
    CHECK(rig.read_two_registers() == "no answer within 60 ms");
  }
}

TEST_CASE("a link that waits for an answer ends at once") {
  Rig rig;
  rig.serve();
  rig.connect(1000 * second);
  rig.server->faults().silent = true;
  rig.link->read_registers(1, 1, rig.keep());
  rig.run_until([&] { return true; });
  rig.link.reset();
  CHECK(rig.answers == 0);
}

TEST_CASE("the server refuses what it does not have") {
  Rig rig;
  rig.serve();
  const auto [request, expected] = GENERATE(table<Bytes, Bytes>({
      // function 4, and one that libmodbus does not know, with data behind it
      {{0, 9, 0, 0, 0, 6, 1, 4, 0, 0, 0, 1}, {0, 9, 0, 0, 0, 3, 1, 0x84, 1}},
      {{0, 9, 0, 0, 0, 6, 1, 43, 14, 1, 0, 1}, {0, 9, 0, 0, 0, 3, 1, 0xab, 1}},
      // 126 registers; one beyond the last; a coil that is neither on nor off
      {{0, 9, 0, 0, 0, 6, 1, 3, 0, 0, 0, 126}, {0, 9, 0, 0, 0, 3, 1, 0x83, 3}},
      {{0, 9, 0, 0, 0, 6, 1, 3, 0, 199, 0, 2}, {0, 9, 0, 0, 0, 3, 1, 0x83, 2}},
      {{0, 9, 0, 0, 0, 6, 1, 5, 0, 0, 0x12, 0x34}, {0, 9, 0, 0, 0, 3, 1, 0x85, 3}},
      // two registers announced, the bytes of one brought
      {{0, 9, 0, 0, 0, 9, 1, 16, 0, 0, 0, 2, 2, 1, 2}, {0, 9, 0, 0, 0, 3, 1, 0x90, 3}},
  }));
  CAPTURE(request);
  rig.send(request);
  REQUIRE(rig.run_until([&] { return rig.received.size() >= expected.size() || rig.closed; }));
  CHECK(rig.received == expected);
  CHECK(rig.writes == 0);
}

TEST_CASE("clients that send anything but Modbus are disconnected, the others are served on") {
  Rig rig;
  rig.serve(4, 2 * second);
  rig.connect();
  SECTION("another protocol") { rig.send({0, 1, 9, 9, 0, 6, 1, 3, 0, 0, 0, 1}); }
  SECTION("another length") { rig.send({0, 1, 0, 0, 0, 99, 1, 3, 0, 0, 0, 1}); }
  SECTION("text") { rig.send(Bytes(300, 'x')); }
  SECTION("half a request, and no more comes") {
    rig.send({0, 1, 0, 0, 0, 6, 1, 3, 0});
    REQUIRE(rig.run_until([&] { return rig.server->connections() == 2; }));
    CHECK(rig.read_two_registers().empty());
  }
  REQUIRE(rig.run_until([&] {
    if (rig.link->idle()) rig.link->read_registers(1, 1, rig.keep());
    return rig.closed;
  }));
  REQUIRE(rig.run_until([&] { return rig.link->idle(); }));
  CHECK(rig.losses == 0);
  CHECK(rig.server->connections() == 1);
}

TEST_CASE("a connection beyond the limit is closed at once") {
  Rig rig;
  rig.serve(1);
  rig.connect();
  REQUIRE(rig.run_until([&] { return rig.server->connections() == 1; }));
  rig.send({0, 1, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1});
  CHECK(rig.run_until([&] { return rig.closed; }));
  CHECK(rig.received.empty());
  CHECK(rig.read_two_registers().empty());
}

}  // namespace
}  // namespace berth
