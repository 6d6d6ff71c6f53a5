// SPDX-License-Identifier: BSD-3-Clause
// The estimator on a bus, with the simulated clock.
#include "estimator/node/estimator_node.h"

#include <algorithm>
#include <berth/event_t.hpp>

#include "common/bus/simulation.h"
#include "common/core/sha256.h"
#include "lcmtypes/channels.h"
#include "test/catch.h"
#include "test/estimator/node/fold_fixture.h"

using namespace berth;
using namespace berth::estimator;

namespace {

struct Run {
  std::string log;  // hash of all that went over the bus
  std::vector<pose_estimate_t> estimates;
  std::vector<estimator_state_t> states;
  std::vector<std::string> events;
};

/// A LIDAR that answers requests, and a commander that acquires after one second.
Run run_for(Utime duration, std::int64_t session = 7) {
  Simulation simulation;
  Run run;
  std::string bytes;
  simulation.record([&](Utime when, const std::string& channel, Bytes message) {
    bytes += std::to_string(when) + channel;
    bytes.append(reinterpret_cast<const char*>(message.data()), message.size());
  });
  SimulatedLoop& loop = simulation.make_loop();
  SimulatedBus& bus = simulation.make_bus();
  EstimatorNode node({"estimator", 7, "hash"}, test_setup(), bus, loop);

  SimulatedLoop& other_loop = simulation.make_loop();
  SimulatedBus& other = simulation.make_bus();
  ScanMaker lidar(replica().mesh);
  lidar.pose = pose_from_xyzwpr({100, -100, 5500, 10, 8, -12});
  std::int64_t answered = 0;
  other.subscribe<scan_request_t>(
      channels::scan_request, Queue::fifo(), [&](const scan_request_t& request) {
        if (request.scan_id == answered) return;
        answered = request.scan_id;
        lidar.utime = other_loop.now();
        for (const auto& p : answer(lidar, request)) {
          other_loop.at(p.utime + p.time_us.back(),
                        [&other, p] { other.publish(channels::scan_data, p); });
        }
      });
  other.subscribe<pose_estimate_t>(
      channels::pose_estimate, Queue::fifo(),
      [&](const pose_estimate_t& estimate) { run.estimates.push_back(estimate); });
  other.subscribe<estimator_state_t>(
      channels::estimator_state, Queue::fifo(),
      [&](const estimator_state_t& state) { run.states.push_back(state); });
  other.subscribe<event_t>(channels::event, Queue::fifo(),
                           [&](const event_t& event) { run.events.push_back(event.code); });
  other_loop.after(second, [&] {
    estimator_command_t acquire = command(estimator_command_t::ACQUIRE, 1, 1);
    acquire.session = session;
    other.publish(channels::estimator_command, acquire);
    other.publish(channels::estimator_command, acquire);
  });
  simulation.run_for(duration);
  run.log = sha256(bytes);
  return run;
}

}  // namespace

TEST_CASE("The node acquires and tracks over the bus, the same to the bit every time") {
  const Run first = run_for(10 * second);
  REQUIRE(first.estimates.size() > 5);
  CHECK(first.estimates.back().status == pose_estimate_t::OK);
  CHECK(first.states.front().mode == estimator_state_t::IDLE);
  CHECK(first.states.back().mode == estimator_state_t::TRACKING);
  CHECK(first.states.back().command_seq == 1);
  const Run second_run = run_for(10 * second);
  CHECK(first.log == second_run.log);
}

TEST_CASE("A command of another session changes nothing, and is reported once") {
  const Run run = run_for(5 * second, 6);
  CHECK(run.estimates.empty());
  CHECK(run.states.back().mode == estimator_state_t::IDLE);
  CHECK(run.states.back().session == 7);
  CHECK(std::count(run.events.begin(), run.events.end(), "command-of-another-session") == 1);
}

TEST_CASE("The configuration file of the estimator is read as it is shipped") {
  const EstimatorOptions options = load_estimator_options("config/estimator.yaml");
  CHECK(options.lidar == "ilris_3d");
  CHECK(options.strategy == ScanStrategy::information);
  CHECK(options.returns_per_scan == 1000);
  CHECK(options.icp_tracking.icp.registration == Registration::point_to_point);
}
