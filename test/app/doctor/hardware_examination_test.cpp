// SPDX-License-Identifier: BSD-3-Clause
// The devices of a simulated cell in a process of its own, on real sockets, examined from here.
#include <berth/injection_state_t.hpp>
#include <berth/injection_t.hpp>
#include <csignal>
#include <fstream>
#include <regex>
#include <thread>

#include "app/doctor/hardware.h"
#include "app/runs/run_files.h"
#include "common/bus/lcm_bus.h"
#include "common/core/child_process.h"
#include "common/core/file.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/free_port.h"

namespace berth {
namespace {

namespace fs = std::filesystem;
using Catch::Matchers::Contains;

void replace(const fs::path& file, const std::string& what, const std::string& by) {
  const std::string text = read_file(file);
  REQUIRE_THAT(text, Contains(what));
  std::string changed = text;
  changed.replace(changed.find(what), what.size(), by);
  std::ofstream(file) << changed;
}

/// A cell's run directory, and the configuration of the examination.
struct ExaminedCell {
  ExaminedCell() {
    RunRequest request;
    request.layout = "range";
    request.target = "radarsat2";
    request.world = "lab";
    request.out = directory.path();
    request.url = "udpm://239.255.76.67:" + std::to_string(free_port()) + "?ttl=0";
    files = RunFiles::create(request);
    setup = files.setup;
    setup.config = directory.path() / "config";
    fs::copy(files.setup.config, setup.config, fs::copy_options::recursive);
  }
  /// Of the cell alone.
  fs::path config() const { return files.setup.config; }

  std::unique_ptr<ChildProcess> start(std::vector<std::string> program) {
    program.insert(program.begin() + 1, {"--run", files.directory.string()});
    return std::make_unique<ChildProcess>(program, ChildOptions{});
  }
  void start() { cell = start({SIMULATED_CELL}); }

  /// Until the cell reports it.
  void inject(const std::string& device, const std::string& fault) {
    ProcessLoop loop(clock_offset_now());
    LcmBus bus(files.url, loop);
    bool active = false;
    bus.subscribe<injection_state_t>(channels::injection_state, Queue::fifo(),
                                     [&](const injection_state_t& state) {
                                       active = state.accepted_seq == 1;
                                       if (active) loop.stop();
                                     });
    injection_t message{};
    message.seq = 1;
    message.session = files.setup.session;
    message.commander = "test";
    message.action = injection_t::INJECT;
    message.device = device;
    message.fault = fault;
    loop.every(50 * millisecond, [&] {
      message.utime = loop.now();
      message.utime_expires = loop.now() + second;
      bus.publish(channels::injection, message);
    });
    loop.after(10 * second, [&] { loop.stop(); });
    bus.start();
    loop.run();
    REQUIRE(active);
  }

  void examine() {
    findings = examine_hardware(setup, 3 * second);
    for (const Finding& f : findings) {
      UNSCOPED_INFO(f.subject << ": " << f.found << " -> " << f.remedy);
    }
  }
  const Finding& about(const std::string& subject) const {
    for (const Finding& f : findings) {
      if (f.subject == subject) return f;
    }
    throw std::runtime_error("nothing about " + subject);
  }
  std::vector<std::string> bad() const {
    std::vector<std::string> subjects;
    for (const Finding& f : findings) {
      if (f.state == Finding::State::bad) subjects.push_back(f.subject);
    }
    return subjects;
  }

  TemporaryDirectory directory;
  RunFiles files;
  RunSetup setup;
  std::unique_ptr<ChildProcess> cell;
  std::vector<Finding> findings;
};

using Subjects = std::vector<std::string>;

TEST_CASE("of a healthy cell nothing is bad, with a driver that runs and without") {
  ExaminedCell cell;
  cell.start();
  cell.examine();
  CHECK(cell.bad() == Subjects{});
  CHECK(cell.findings.size() == 21);
  CHECK_THAT(cell.about("sensor arm heartbeat").found, Contains("no driver writes the host's"));
  CHECK_THAT(cell.about("replica arm tick").found, Contains("renewed every"));
  CHECK_THAT(cell.about("replica arm pose").found, Contains("the flange is 0.0"));
  CHECK_THAT(cell.about("PLC safety chain").found, Contains("E-stop chain closed, fence closed"));
  CHECK_THAT(cell.about("LIDAR identity").found, Contains("serial"));

  const auto driver = cell.start({ARM_DRIVER, "--arm", "replica"});
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  cell.examine();
  CHECK(cell.bad() == Subjects{});
  CHECK_THAT(cell.about("replica arm heartbeat").found, Contains("set-point number comes back"));
  driver->signal(SIGTERM);
  CHECK(driver->wait().ok());
}

TEST_CASE("a wrong assignment, a silent PLC and another LIDAR are found, and what mends them") {
  ExaminedCell cell;
  const fs::path registers = cell.config() / "registers";
  fs::copy(registers / "snpx.yaml", registers / "other.yaml");
  replace(registers / "other.yaml", R"(variable: "R[1]", multiply: 0)",
          R"(variable: "R[1]", multiply: 1)");
  replace(cell.config() / "devices.yaml", "registers: snpx", "registers: other");
  replace(cell.config() / "devices.yaml", "model: ilris_3d", "model: short_range");
  cell.start();
  cell.inject("plc", "silent");
  cell.examine();
  CHECK(cell.bad() == Subjects{"replica arm register map", "PLC connection", "LIDAR identity"});
  CHECK_THAT(cell.about("replica arm register map").found, Contains("expected"));
  CHECK_THAT(cell.about("replica arm register map").remedy,
             Contains("$SNPX_ASG[2]: $ADDRESS 51, $SIZE 32, $VAR_NAME R[1], $MULTIPLY 0"));
  CHECK_THAT(cell.about("PLC connection").found,
             Contains("takes connections, but answers no read: no answer within 100 ms"));
  CHECK_THAT(cell.about("LIDAR identity").found, Contains("expected"));
}

TEST_CASE("another arm than the configured one, in a fault, and no device at an address") {
  ExaminedCell cell;
  replace(cell.config() / "arms" / "m710ic_50.yaml", "d6: 175 mm", "d6: 180 mm");
  replace(
      cell.setup.config / "devices.yaml",
      [&] {
        const std::string text = read_file(cell.setup.config / "devices.yaml");
        std::smatch found;
        REQUIRE(std::regex_search(text, found, std::regex("plc:\\s+address: \\S+")));
        return found.str();
      }(),
      "plc:\n  address: " + free_address());
  cell.start();
  cell.inject("plc", "estop");
  cell.examine();
  CHECK(cell.bad() == Subjects{"replica arm pose", "sensor arm pose", "PLC connection"});
  CHECK_THAT(cell.about("replica arm pose").found, Contains("5.0 mm away"));
  CHECK_THAT(cell.about("sensor arm state").found,
             Contains("emergency stop") && Contains("SRVO-001 Emergency stop"));
  CHECK_THAT(cell.about("PLC connection").found, Contains("no answer"));
}

}  // namespace
}  // namespace berth
