// SPDX-License-Identifier: BSD-3-Clause
// An alarm of the controllers in the midst of a procedure, and the same run after it.
#include <berth/ground_truth_t.hpp>
#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>

#include "evaluation/compare/comparison.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_writer.h"
#include "procedures/engine/procedure_node.h"
#include "procedures/engine/run_info.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/testbed/safety/world.h"

namespace berth::drills {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

constexpr char procedure_text[] = R"(name: recovery
steps:
  - move: {to: [200, -150, 4200, 5, 15, -10], speed: 100 mm/s, turn: 10 deg/s}
teardown:
  - lights: {sun: 0 %, albedo: 0 %}
criteria:
  - {name: it has gone the way, measurement: relative_speed, statistic: peak, min: 50 mm/s}
)";
const Pose goal = pose_from_xyzwpr({200, -150, 4200, 5, 15, -10});

/// The whole cell in the twin, a procedure in it and an operator, recorded.
struct AttendedRun {
  explicit AttendedRun(bool in_control) {
    world.simulation.record([this](Utime utime, const std::string& channel, Bytes bytes) {
      log.write(utime, channel, bytes);
    });
    bus = &world.simulation.make_bus();
    bus->subscribe<procedure_state_t>(channels::procedure_state, Queue::fifo(),
                                      [this](const procedure_state_t& m) { state = m; });
    bus->subscribe<ground_truth_t>(channels::ground_truth, Queue::fifo(),
                                   [this](const ground_truth_t& m) {
                                     if (truth.utime > 0) {
                                       truth_gap = std::max(truth_gap, m.utime - truth.utime);
                                     }
                                     truth = m;
                                   });
    bus->subscribe<command_answers_t>(channels::procedure_answers, Queue::fifo(),
                                      [this](const command_answers_t& m) {
                                        for (const auto& a : m.answers) answers[a.seq] = a;
                                      });
    auto procedure = procedures::parse_procedure(procedure_text, "recovery.yaml");
    ProcedureRun run;
    run.name = "recovery";
    run.host = run_info_t::TWIN;
    run.required_nodes = {"testbed", "arm-driver-replica", "arm-driver-sensor", "facility-driver"};
    RunSetup setup;
    setup.session = session;
    setup.target = "radarsat2";
    const Target target = load_target("radarsat2", 0);
    auto info = procedures::make_run_info(procedure, setup, target, run.name, run.host, "hash");
    SimulatedLoop& loop = world.simulation.make_loop();
    node = std::make_unique<ProcedureNode>(
        NodeSetup{"procedure", session, "hash"}, std::move(procedure), run, std::move(info),
        evaluation::nearest_point_on(target), world.simulation.make_bus(), loop);
    node->when_finished([this] { done = true; });
    if (in_control) {
      command(procedure_command_t::TAKE_CONTROL);
      world.simulation.make_loop().every(500 * millisecond,
                                         [this] { command(procedure_command_t::KEEP_CONTROL); });
    }
    REQUIRE(world.run_until([&] { return world.state.state == testbed_state_t::MOVING; }, 20));
    world.run_for(3);
  }

  std::int64_t command(std::int8_t what) {
    procedure_command_t message{};
    message.utime = world.now();
    message.seq = ++seq;
    message.session = session;
    message.utime_expires = message.utime + second;
    message.commander = "anna";
    message.command = what;
    bus->publish(channels::procedure_command, message);
    return seq;
  }
  /// Why not; empty: it was accepted.
  std::string request(std::int8_t what) {
    const std::int64_t sent_seq = command(what);
    world.run_for(0.5);
    REQUIRE(answers.contains(sent_seq));
    return answers[sent_seq].answer == command_answer_t::ACCEPTED ? "" : answers[sent_seq].reason;
  }
  Joints replica() { return world.true_joints(ArmRole::replica); }

  static constexpr std::int64_t session = 77;
  TemporaryDirectory directory;
  logs::LogWriter log{directory.path() / "log.lcm"};
  World world{{}};
  SimulatedBus* bus = nullptr;
  std::unique_ptr<ProcedureNode> node;
  procedure_state_t state{};
  ground_truth_t truth{};
  Utime truth_gap = 0;
  std::map<std::int64_t, command_answer_t> answers;
  std::int64_t seq = 0;
  bool done = false;
};

TEST_CASE("after an alarm is put right and reset the same run goes on") {
  const auto [fault, alarm] = GENERATE(std::pair{"estop", "SRVO-001 Emergency stop"},
                                       std::pair{"fence", "SRVO-004 Fence open"});
  AttendedRun run(true);
  run.world.inject("plc", fault);
  run.world.run_for(2);
  CHECK(run.state.state == procedure_state_t::HELD);
  CHECK_THAT(run.state.reason, StartsWith("testbed fault: ") && Contains(alarm));
  CHECK(run.state.steps[0].state == procedure_step_t::RUNNING);
  const Joints stands = run.replica();

  // Neither helps while the condition stands, and both refusals name it.
  CHECK_THAT(run.request(procedure_command_t::RESUME), Contains(alarm));
  CHECK_THAT(run.request(procedure_command_t::RESET), Contains(alarm));
  run.world.clear_faults();
  run.world.run_for(1);
  CHECK_THAT(run.request(procedure_command_t::RESUME), Contains(alarm));
  CHECK(run.replica() == stands);

  CHECK(run.request(procedure_command_t::RESET).empty());
  run.world.run_for(0.5);
  CHECK(run.state.state == procedure_state_t::HELD);
  CHECK_THAT(run.state.reason, Contains("; resume goes on"));
  CHECK(run.world.state.state == testbed_state_t::HELD);
  CHECK(run.replica() == stands);  // a reset moves nothing

  CHECK(run.request(procedure_command_t::RESUME).empty());
  REQUIRE(run.world.run_until([&] { return run.done; }, 120));
  INFO(run.node->state().reason);
  CHECK(run.node->state().outcome == procedure_state_t::PASS);
  CHECK(run.node->state().steps[0].attempts == 1);
  CHECK(distance(run.world.cell().true_relative_pose(run.world.now()), goal) < 0.01);

  // Ground truth went on all the time, and the verdict comes out of the one log again.
  CHECK(run.truth_gap == 8 * millisecond);
  CHECK((Vector3d::Map(run.truth.position_m) - goal.position).norm() < 1e-4);
  run.log.flush();
  CHECK(evaluation::compare_log(run.directory.path() / "log.lcm").agrees);
}

TEST_CASE("an alarm while no operator has control ends the run") {
  AttendedRun run(false);
  run.world.inject("plc", "estop");
  REQUIRE(run.world.run_until([&] { return run.done; }, 60));
  CHECK(run.node->state().outcome == procedure_state_t::ERROR);
  CHECK_THAT(run.node->state().reason, Contains("controller error 103"));
}

TEST_CASE("an alarm on hold, and one that comes again") {
  AttendedRun run(true);
  CHECK(run.request(procedure_command_t::HOLD).empty());
  CHECK_THAT(run.request(procedure_command_t::RESUME), Contains("come to rest"));
  run.world.inject("plc", "fence");
  run.world.run_for(2);
  CHECK_THAT(run.state.reason, Contains("SRVO-004"));
  for (int again = 0; again < 2; ++again) {
    run.world.clear_faults();
    run.world.run_for(1);
    CHECK(run.request(procedure_command_t::RESET).empty());
    run.world.run_for(0.5);
    CHECK(run.request(procedure_command_t::RESUME).empty());
    if (again == 1) break;
    run.world.inject("plc", "estop");  // on the way back to the path
    run.world.run_for(2);
    CHECK_THAT(run.state.reason, Contains("SRVO-001"));
  }
  REQUIRE(run.world.run_until([&] { return run.done; }, 120));
  INFO(run.node->state().reason);
  CHECK(run.node->state().outcome == procedure_state_t::PASS);
}

TEST_CASE("a closed loop goes on after an alarm, to its end") {
  World::Options options;
  options.estimator = true;
  World world(options);
  world.begin_approach();
  world.inject("plc", "estop");
  world.run_for(3);
  CHECK(world.state.state == testbed_state_t::FAULT);
  const std::int64_t sent_seq = world.state.command_seq;
  world.clear_faults();
  world.run_for(1);
  world.send(testbed_command2_t::RESET);
  world.run_for(0.5);
  CHECK(world.state.state == testbed_state_t::HELD);
  world.send(testbed_command2_t::RESUME);
  world.run_for(3);
  CHECK(world.state.state == testbed_state_t::CLOSED_LOOP);
  CHECK(world.run_until([&] { return world.state.finished_seq == sent_seq; }, 120));
}

}  // namespace
}  // namespace berth::drills
