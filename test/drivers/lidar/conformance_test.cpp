// SPDX-License-Identifier: BSD-3-Clause
// Conformance of devices over real sockets: the simulated LIDAR, and wrong ones made of it.
#include "drivers/lidar/conformance.h"

#include <future>
#include <set>
#include <thread>

#include "common/bus/process_loop.h"
#include "common/core/error.h"
#include "drivers/lidar/connection.h"
#include "drivers/simulated/lidar/simulated_lidar.h"
#include "test/catch.h"
#include "test/drivers/lidar/lidar_fixture.h"
#include "test/drivers/simulated/receiver/wall_scene.h"
#include "test/free_port.h"

using namespace berth;
using namespace berth::lidar;

namespace {

/// Something that serves, in a thread with a loop of its own until this ends.
class Served {
 public:
  /// make: called on that thread; what it returns lives as long as the loop.
  explicit Served(const std::function<std::shared_ptr<void>(ProcessLoop&)>& make) {
    std::promise<ProcessLoop*> ready;
    auto future = ready.get_future();
    thread_ = std::thread([&ready, make] {
      ProcessLoop loop(clock_offset_now());
      const auto device = make(loop);
      ready.set_value(&loop);
      loop.run();
    });
    loop_ = future.get();
  }
  ~Served() {
    loop_->stop();
    thread_.join();
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;

 private:
  ProcessLoop* loop_ = nullptr;
  std::thread thread_;
};

struct SceneAndLidar {
  SceneAndLidar(ProcessLoop& loop, const std::string& address)
      : scene(loop.now()), lidar(address, ilris(), offset(), 1, loop, scene) {}
  static SimulatedLidarSettings offset() {
    SimulatedLidarSettings device;
    device.clock_offset = -1000 * second;
    return device;
  }
  WallScene scene;
  SimulatedLidar lidar;
};

/// A proxy in front of a device that changes its messages.
class Meddler {
 public:
  /// The changed message; none: it is dropped.
  using Change = std::function<std::optional<Message>(const Message&)>;

  Meddler(ProcessLoop& loop, const std::string& address, const std::string& device, Change change) {
    listen(loop, address, [this, &loop, device, change](std::unique_ptr<Connection> accepted) {
      auto& pair = *pairs_.emplace_back(std::make_unique<Pair>());
      pair.host = std::move(accepted);
      pair.host->open(
          [&pair](const Message& message) {
            pair.device ? pair.device->send(message) : pair.early.push_back(message);
          },
          [&pair, &loop](const std::string& reason) {
            pair.host->send(Complaint{reason});
            loop.after(0, [&pair] { pair.host.reset(), pair.device.reset(); });
          });
      dial(
          loop, device,
          [&pair, &loop, change](std::unique_ptr<Connection> connection, const std::string&) {
            if (!connection) return;
            pair.device = std::move(connection);
            pair.device->open(
                [&pair, change](const Message& message) {
                  if (const auto* id = std::get_if<Identity>(&message)) {
                    pair.host->speak(id->version);
                  }
                  if (const auto changed = change(message); changed && pair.host)
                    pair.host->send(*changed);
                },
                [&pair, &loop](const std::string&) {
                  loop.after(0, [&pair] { pair.host.reset(), pair.device.reset(); });
                });
            for (const Message& message : pair.early) pair.device->send(message);
          },
          second);
    });
  }

 private:
  struct Pair {
    std::unique_ptr<Connection> host;
    std::unique_ptr<Connection> device;
    std::vector<Message> early;
  };
  std::vector<std::unique_ptr<Pair>> pairs_;
};

struct Verdict {
  bool good = false;
  std::set<std::string> failed;
  std::size_t checks = 0;
};

Verdict test(const std::string& address) {
  Verdict verdict;
  verdict.good = test_conformance(address, [&](const ConformanceCheck& check) {
    ++verdict.checks;
    INFO(check.name << ": " << check.found);
    CHECK_FALSE(check.name.empty());
    CHECK((check.outcome == ConformanceCheck::Outcome::failed) == !check.mend.empty());
    if (check.outcome == ConformanceCheck::Outcome::failed) verdict.failed.insert(check.name);
  });
  return verdict;
}

Verdict test_changed(const Meddler::Change& change) {
  const std::string device = free_address();
  const std::string address = free_address();
  const Served lidar(
      [&](ProcessLoop& loop) { return std::make_shared<SceneAndLidar>(loop, device); });
  const Served meddler(
      [&](ProcessLoop& loop) { return std::make_shared<Meddler>(loop, address, device, change); });
  return test(address);
}

}  // namespace

TEST_CASE("the simulated LIDAR conforms to the protocol in every check") {
  const std::string address = free_address();
  const Served lidar(
      [&](ProcessLoop& loop) { return std::make_shared<SceneAndLidar>(loop, address); });
  const Verdict verdict = test(address);
  CHECK(verdict.failed.empty());
  CHECK(verdict.good);
  CHECK(verdict.checks > 35);
}

TEST_CASE("three wrong answers of a device fail in their own checks alone") {
  const Verdict verdict = test_changed([](Message message) -> std::optional<Message> {
    if (auto* answer = std::get_if<ScanAnswer>(&message)) answer->reason.clear();
    if (auto* status = std::get_if<Status>(&message)) {
      if (status->state == DeviceState::idle) status->token ^= 1;
    }
    if (auto* returns = std::get_if<Returns>(&message)) {
      for (BeamReturn& beam : returns->beams) beam.azimuth_rad = -beam.azimuth_rad;
    }
    return message;
  });
  CHECK_FALSE(verdict.good);
  CHECK(verdict.failed ==
        std::set<std::string>{"Status", "version 2: directions", "version 1: directions",
                              "a second order", "refuses a window outside the field of view",
                              "refuses an order without windows",
                              "refuses neither count nor spacing", "refuses a negative width",
                              "refuses half of the minimum step"});
}

TEST_CASE("a device without answer to Cancel, whose clock is of milliseconds, is found out") {
  const Verdict verdict = test_changed([](Message message) -> std::optional<Message> {
    if (auto* status = std::get_if<Status>(&message)) status->device_time /= 1000;
    if (auto* end = std::get_if<ScanEnd>(&message); end != nullptr) {
      if (end->result == ScanResult::cancelled) return std::nullopt;
    }
    return message;
  });
  CHECK(verdict.failed ==
        std::set<std::string>{"device clock", "version 2: stamps", "version 1: stamps", "Cancel"});
}

TEST_CASE("without a listening device there is nothing to test") {
  CHECK_THROWS_AS(test_conformance(free_address(), [](const ConformanceCheck&) {}), InputError);
  CHECK_THROWS_AS(test_conformance("nowhere", [](const ConformanceCheck&) {}), InputError);
}
