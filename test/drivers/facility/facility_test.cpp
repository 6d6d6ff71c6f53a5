// SPDX-License-Identifier: BSD-3-Clause
#include <berth/event_t.hpp>
#include <optional>
#include <vector>

#include "common/bus/simulation.h"
#include "drivers/facility/facility_node.h"
#include "drivers/simulated/simulated_plc.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"

namespace berth {
namespace {

struct Facility {
  Facility() {
    PlcDevice device = load_devices("config").plc;
    device.address = "plc:502";
    const PlcMap map = PlcMap::load("config/registers/plc.yaml");
    plc.emplace("plc:502", map, SimulatedPlc::Options{}, simulation.make_loop(),
                [this](bool estop, bool fence) {
                  chain = {estop, fence};
                });
    node.emplace(NodeSetup{"facility-driver", 7, ""}, device, map, simulation.make_bus(),
                 simulation.make_loop());
    bus.subscribe<facility_state_t>(channels::facility_state, Queue::fifo(),
                                    [this](const facility_state_t& s) {
                                      state = s;
                                      ++states;
                                    });
    bus.subscribe<command_answers_t>(channels::facility_answers, Queue::fifo(),
                                     [this](const command_answers_t& a) { answers = a; });
    bus.subscribe<event_t>(channels::event, Queue::fifo(),
                           [this](const event_t& e) { codes.push_back(e.code); });
    simulation.run_for(500 * millisecond);
  }
  facility_command_t lamps(double sun, double albedo) {
    facility_command_t command{};
    command.seq = ++seq;
    command.utime = simulation.now();
    command.utime_expires = command.utime + second;
    command.session = 7;
    command.sun_lamp = sun;
    command.albedo_lamp = albedo;
    command.sun_azimuth_rad = radians(-35.25);
    command.sun_elevation_rad = radians(10.0);
    return command;
  }
  /// Status and reason of the last request.
  std::string answer() const {
    for (const command_answer_t& one : answers.answers) {
      if (one.seq == seq) {
        return one.answer == command_answer_t::ACCEPTED ? "accepted" : "refused: " + one.reason;
      }
    }
    return "none";
  }
  bool saw(const std::string& code) const {
    return std::find(codes.begin(), codes.end(), code) != codes.end();
  }

  Simulation simulation;
  Bus& bus = simulation.make_bus();
  std::optional<SimulatedPlc> plc;
  std::optional<FacilityNode> node;
  std::pair<bool, bool> chain{true, true};
  facility_state_t state{};
  int states = 0;
  std::vector<std::string> codes;
  command_answers_t answers{};
  std::int64_t seq = 0;
};

TEST_CASE("the facility's state comes at 10 Hz, the chain closed, the lamps dark") {
  Facility f;
  f.states = 0;
  f.simulation.run_for(5 * second);
  CHECK(f.states == 50);
  CHECK(f.state.valid);
  CHECK(f.state.estop_chain_closed);
  CHECK(f.state.fence_closed);
  CHECK(f.state.motion_enabled);
  CHECK(f.state.sun_lamp == 0);
}

TEST_CASE("lamps come up to the requested power, and the sun's direction is shown") {
  Facility f;
  f.bus.publish(channels::facility_command, f.lamps(0.8, 0.25));
  f.simulation.run_for(500 * millisecond);
  CHECK(f.state.sun_lamp > 0.3);
  CHECK(f.state.sun_lamp < 0.6);
  f.simulation.run_for(second);
  CHECK(f.state.sun_lamp == Approx(0.8));
  CHECK(f.state.albedo_lamp == Approx(0.25));
  CHECK(f.state.sun_azimuth_rad == Approx(radians(-35.25)));
  CHECK(f.state.sun_elevation_rad == Approx(radians(10.0)));
  f.bus.publish(channels::facility_command, f.lamps(0.8, 0.25));  // repeats change nothing
  f.simulation.run_for(200 * millisecond);
  CHECK(f.state.sun_lamp == Approx(0.8));
}

TEST_CASE("the lamp takes its time to turn, the shorter way round") {
  Facility f;
  facility_command_t command = f.lamps(0, 0);
  command.sun_azimuth_rad = radians(350.0);  // 10 deg the other way
  command.sun_elevation_rad = radians(90.0);
  f.bus.publish(channels::facility_command, command);
  f.simulation.run_for(300 * millisecond);
  CHECK(f.state.sun_azimuth_rad == Approx(radians(-10.0)));
  CHECK(f.state.sun_elevation_rad > radians(20.0));
  CHECK(f.state.sun_elevation_rad < radians(70.0));
  f.simulation.run_for(500 * millisecond);
  CHECK(f.state.sun_elevation_rad == Approx(radians(90.0)));
}

TEST_CASE("lamp commands that are foreign, late or senseless change nothing") {
  Facility f;
  facility_command_t command = f.lamps(1, 1);
  command.session = 6;
  f.bus.publish(channels::facility_command, command);
  command = f.lamps(1, 1);
  command.utime_expires = f.simulation.now() - 1;
  f.bus.publish(channels::facility_command, command);
  f.bus.publish(channels::facility_command, f.lamps(1.5, 0));
  f.simulation.run_for(2 * second);
  CHECK(f.saw("command-of-another-session"));
  CHECK(f.saw("command-expired"));
  CHECK(f.saw("command-refused"));
  CHECK(f.state.sun_lamp == 0);
  CHECK(f.plc->albedo_lamp() == 0);
}

TEST_CASE("each lamp command is answered: when the PLC has taken it, or with the reason") {
  Facility f;
  facility_command_t command = f.lamps(0.8, 0.25);
  f.bus.publish(channels::facility_command, command);
  f.simulation.run_for(50 * millisecond);
  CHECK(f.answer() == "accepted");
  SECTION("a repetition is answered again and obeyed once") {
    f.simulation.run_for(12 * second);
    f.bus.publish(channels::facility_command, f.lamps(0.1, 0));
    f.simulation.run_for(2 * second);
    f.bus.publish(channels::facility_command, command);
    f.simulation.run_for(2 * second);
    CHECK(f.answers.answers[0].seq == command.seq);
    CHECK(f.state.sun_lamp == Approx(0.1));
  }
  SECTION("senseless") {
    f.bus.publish(channels::facility_command, f.lamps(1.5, 0));
    f.simulation.run_for(50 * millisecond);
    CHECK(f.answer() == "refused: levels must be 0 to 1 and angles finite");
  }
  SECTION("of another run") {
    command = f.lamps(1, 0);
    command.session = 6;
    f.bus.publish(channels::facility_command, command);
    f.simulation.run_for(50 * millisecond);
    CHECK(f.answer() == "refused: a command of session 6 was ignored");
  }
  SECTION("too late") {
    command = f.lamps(1, 0);
    command.utime_expires = f.simulation.now() - 1;
    f.bus.publish(channels::facility_command, command);
    f.simulation.run_for(50 * millisecond);
    CHECK(f.answer() == "refused: a command came after it had expired");
  }
  SECTION("of a PLC that does not answer: none, and the repetition is tried again") {
    f.plc->server().faults().silent = true;
    command = f.lamps(0.4, 0);
    command.utime_expires += 60 * second;
    f.bus.publish(channels::facility_command, command);
    f.simulation.run_for(3 * second);
    CHECK(f.answer() == "none");
    f.plc->server().faults().silent = false;
    f.simulation.run_for(5 * second);
    f.bus.publish(channels::facility_command, command);
    f.simulation.run_for(second);
    CHECK(f.answer() == "accepted");
    CHECK(f.state.sun_lamp == Approx(0.4));
  }
}

TEST_CASE("an open chain or fence is on the bus within 60 ms, and handed on to the arms") {
  Facility f;
  const auto seen_after = [&](const std::function<bool()>& seen) {
    const Utime begin = f.simulation.now();
    REQUIRE(f.simulation.run_until(seen, begin + second));
    return f.simulation.now() - begin;
  };
  f.plc->press_estop(true);
  CHECK_FALSE(f.chain.first);
  CHECK(seen_after([&] { return !f.state.estop_chain_closed; }) < 60 * millisecond);
  CHECK_FALSE(f.state.motion_enabled);
  f.simulation.run_for(10 * millisecond);
  CHECK(f.saw("estop"));
  f.plc->press_estop(false);
  CHECK(seen_after([&] { return f.state.estop_chain_closed; }) < 60 * millisecond);
  f.plc->open_fence(true);
  CHECK_FALSE(f.chain.second);
  CHECK(seen_after([&] { return !f.state.fence_closed; }) < 60 * millisecond);
  CHECK(f.state.estop_chain_closed);
}

TEST_CASE("a PLC that does not answer is not taken for a closed chain") {
  Facility f;
  f.plc->server().faults().silent = true;
  f.simulation.run_for(500 * millisecond);
  CHECK_FALSE(f.state.valid);
  CHECK_FALSE(f.state.estop_chain_closed);
  CHECK(f.state.reason == "no answer within 100 ms");
  CHECK(f.saw("plc-lost"));
  f.plc->server().faults().silent = false;
  f.simulation.run_for(3 * second);
  CHECK(f.state.valid);
  CHECK(f.state.estop_chain_closed);
  CHECK_FALSE(f.saw("estop"));
}

TEST_CASE("a chain opened or closed while the PLC was not seen gives its event when it is seen") {
  Facility f;
  const auto unseen = [&](const std::function<void()>& meanwhile) {
    f.plc->server().faults().silent = true;
    f.simulation.run_for(500 * millisecond);
    REQUIRE_FALSE(f.state.valid);
    meanwhile();
    f.plc->server().faults().silent = false;
    f.codes.clear();
    f.simulation.run_for(3 * second);
    REQUIRE(f.state.valid);
  };
  unseen([&] { f.plc->press_estop(true); });
  CHECK(f.saw("estop"));
  CHECK_FALSE(f.saw("motion-disabled"));
  unseen([] {});
  CHECK_FALSE(f.saw("estop"));  // once
  unseen([&] {
    f.plc->press_estop(false);
    f.plc->open_fence(true);
  });
  CHECK(f.saw("estop-released"));
  CHECK(f.saw("fence-open"));
  unseen([&] { f.plc->open_fence(false); });
  CHECK(f.saw("fence-closed"));
}

TEST_CASE("a chain that is open when the PLC is first seen gives its event") {
  Facility f;
  f.plc->press_estop(true);
  f.node.reset();
  f.codes.clear();
  PlcDevice device = load_devices("config").plc;
  device.address = "plc:502";
  f.node.emplace(NodeSetup{"facility-driver", 7, ""}, device,
                 PlcMap::load("config/registers/plc.yaml"), f.simulation.make_bus(),
                 f.simulation.make_loop());
  f.simulation.run_for(500 * millisecond);
  CHECK(f.saw("estop"));
}

}  // namespace
}  // namespace berth
