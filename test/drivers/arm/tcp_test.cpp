// SPDX-License-Identifier: BSD-3-Clause
#include <berth/arm_command_t.hpp>
#include <berth/arm_state_t.hpp>
#include <functional>
#include <map>

#include "common/bus/process_loop.h"
#include "drivers/arm/arm_node.h"
#include "drivers/arm/snpx_adapter.h"
#include "drivers/simulated/simulated_controller.h"
#include "test/catch.h"
#include "test/free_port.h"

namespace berth {
namespace {

/// Hands messages on at once, within one loop.
class LocalBus final : public Bus {
 protected:
  void send(const std::string& channel, Bytes bytes) override {
    const std::vector<std::uint8_t> copy(bytes.begin(), bytes.end());
    for (const RawHandler& handler : handlers_[channel]) handler(copy);
  }
  void receive(const std::string& channel, Queue, RawHandler handler) override {
    handlers_[channel].push_back(std::move(handler));
  }

 private:
  std::map<std::string, std::vector<RawHandler>> handlers_;
};

TEST_CASE("over real TCP the driver starts the arm and moves it") {
  ProcessLoop loop(clock_offset_now());
  LocalBus bus;
  const std::string address = free_address();
  const RegisterMap map = RegisterMap::load("config/registers/snpx.yaml");
  PlacedArm arm;
  arm.kinematics = ArmKinematics::load("config/arms/m710ic_50.yaml");
  arm.home = {0, 0, 0, 0, -0.5, 0};
  SimulatedController controller(address, map, arm, {}, {}, loop);

  ArmNode::Setup setup;
  setup.device = load_devices("config").replica_arm;
  setup.device.address = address;
  setup.device.timeout = 5 * second;  // a busy machine is no reason to fail
  setup.kinematics = arm.kinematics;
  ArmNode node(NodeSetup{"arm-driver-replica", 1, ""}, setup,
               std::make_unique<SnpxAdapter>(setup.device, map, *arm.kinematics, loop), bus, loop);

  int samples = 0;
  arm_state_t last{};
  bus.subscribe<arm_state_t>(arm_state_channel(ArmRole::replica), Queue::fifo(),
                             [&](const arm_state_t& state) {
                               last = state;
                               ++samples;
                             });
  std::int64_t seq = 0;
  double way = 0;
  bool stopped = false;
  loop.every(20 * millisecond, [&] {
    if (way > 0.02 && last.reported_joint[0] > 0.015) {
      stopped = true;
      return loop.stop();
    }
    if (!last.valid) return;
    const bool running = last.state == arm_state_t::RUNNING;
    if (running && way < 0.025) way += 0.001;
    arm_command_t command{};
    command.utime = loop.now();
    command.utime_expires = loop.now() + 10 * second;
    command.seq = ++seq;
    command.session = 1;
    command.action = running ? arm_command_t::STREAM : arm_command_t::START;
    command.speed_limit = 1;
    command.joint[0] = way;
    command.joint[4] = -0.5;
    bus.publish(arm_command_channel(ArmRole::replica), command);
  });
  loop.after(60 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(stopped);
  CHECK(samples > 20);
  CHECK(last.setpoint_seq_echoed > 0);
  CHECK(last.utime_received >= last.utime_sent);
  CHECK(std::abs(last.utime - last.utime_received) < 10 * second);
}

TEST_CASE("without a listener a dial fails, and the link keeps dialling") {
  ProcessLoop loop(clock_offset_now());
  const std::string address = free_address();
  bool refused = false;
  loop.sockets().dial(address, [&](const Socket& socket) {
    refused = socket.fd() < 0;
    loop.stop();
  });
  loop.after(30 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(refused);

  bool connected = false;
  const auto link = make_register_link(loop, {address}, [&](bool up, const std::string&) {
    connected = up;
    loop.stop();
  });
  Socket device;
  loop.after(300 * millisecond, [&] {
    loop.sockets().listen(address, [&](Socket socket) { device = std::move(socket); });
  });
  loop.after(30 * second, [&] { loop.stop(); });
  loop.run();
  CHECK(connected);
}

}  // namespace
}  // namespace berth
