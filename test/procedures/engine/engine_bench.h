// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <unistd.h>

#include <filesystem>
#include <memory>

#include "app/terminal/progress.h"
#include "evaluation/run/target_surface.h"
#include "logs/file/log_writer.h"
#include "procedures/engine/procedure_node.h"
#include "test/catch.h"
#include "test/procedures/engine/fake_cell.h"

namespace berth::fake {

inline const char* const script_text = R"(name: test
steps:
  - lights: {sun: 50 %}
  - move: {to: [0, 0, 5000, 0, 0, 0], speed: 100 mm/s}
  - acquire: {returns: 3000}
    timeout: 10 s
  - track: {returns: 1000, settle: 3}
  - approach: {standoff: 3.2 m, speed: 20 mm/s}
  - hold: 4 s
criteria:
  - {name: position, measurement: position_error, statistic: rms, phase: hold, max: 10 mm}
  - {name: range, measurement: surface_range, statistic: final, phase: hold, min: 3 m}
  - {name: share, measurement: tracking_share, phase: hold, min: 95 %}
)";

inline std::string procedure_of(const std::string& steps) { return "name: test\nsteps:\n" + steps; }

/// The engine and its fake cell, on a simulated clock, recorded.
class EngineBench {
 public:
  explicit EngineBench(const Script& given = {}, const std::string& text = script_text)
      : script(given) {
    writer = std::make_unique<logs::LogWriter>(log);
    simulation.record([this](Utime utime, const std::string& channel, Bytes bytes) {
      writer->write(utime, channel, bytes);
    });
    testbed = add<Testbed>();
    estimator = add<Estimator>();
    facility = add<Facility>();
    lidar = add<LidarDriver>();
    if (script.simulated_cell) cell = add<SimulatedCell>();

    auto procedure = procedures::parse_procedure(text, "test.yaml");
    ProcedureRun run;
    run.name = "test-run";
    run.host = run_info_t::TWIN;
    run.required_nodes = {"testbed", "estimator", "facility-driver", "lidar-driver"};
    run.ready_timeout = 5 * second;
    run.attended = given.attended;
    RunSetup setup;
    setup.session = session;
    setup.target = "radarsat2";
    const Target target = load_target("radarsat2", 0);
    auto info = procedures::make_run_info(procedure, setup, target, run.name, run.host, "hash");
    SimulatedLoop& loop = simulation.make_loop();
    node = std::make_unique<ProcedureNode>(
        NodeSetup{"procedure", session, "hash"}, std::move(procedure), run, std::move(info),
        evaluation::nearest_point_on(target), simulation.make_bus(), loop);
    node->when_finished([this] { done = true; });

    operator_bus = &simulation.make_bus();
    listen<procedure_state_t>(channels::procedure_state);
    listen<pose_estimate_t>(channels::pose_estimate);
    listen<ground_truth_t>(channels::ground_truth);
    listen<event_t>(channels::event);
    operator_bus->subscribe<event_t>(channels::event, Queue::fifo(),
                                     [this](const event_t& m) { events.push_back(m); });
  }
  ~EngineBench() { std::filesystem::remove(log); }

  /// Runs to the end; the outcome.
  int run(double limit_s = 120) {
    REQUIRE(simulation.run_until([this] { return done; },
                                 simulation.now() + utime_from_seconds(limit_s)));
    writer->flush();
    return node->state().outcome;
  }

  void run_for(double s) { simulation.run_for(utime_from_seconds(s)); }

  void command(std::int8_t what, const std::string& text = "", const std::string& prompt = "") {
    procedure_command_t message{};
    message.utime = simulation.now();
    message.seq = ++operator_seq;
    message.session = session;
    message.utime_expires = message.utime + second;
    message.commander = "operator";
    message.command = what;
    message.text = text;
    message.prompt_id = prompt;
    operator_bus->publish(channels::procedure_command, message);
  }

  const procedure_step_t& step(const std::string& name) const {
    for (const auto& step : node->state().steps) {
      if (step.name == name) return step;
    }
    throw std::logic_error("no step " + name);
  }

  bool testbed_received(std::int8_t what) const {
    for (const auto& c : testbed->obeyed) {
      if (c.command == what) return true;
    }
    return false;
  }

  /// Runs until the procedure is in this state.
  void run_to(std::int8_t state, double limit_s = 60) {
    REQUIRE(simulation.run_until([&] { return node->state().state == state; },
                                 simulation.now() + utime_from_seconds(limit_s)));
  }

  /// The first event of this code; empty: none.
  std::string event_text(const std::string& code) const {
    for (const event_t& event : events) {
      if (event.code == code) return event.text;
    }
    return "";
  }

  const precondition_t& precondition(const std::string& name) const {
    for (const auto& p : node->state().preconditions) {
      if (p.name == name) return p;
    }
    throw std::logic_error("no precondition " + name);
  }

  bool printed(const std::string& text) const {
    for (const auto& line : lines) {
      if (line.find(text) != std::string::npos) return true;
    }
    return false;
  }

  Script script;
  Simulation simulation;
  std::filesystem::path log =
      std::filesystem::temp_directory_path() /
      ("berth-engine-" + std::to_string(::getpid()) + "-" + std::to_string(count++));
  std::unique_ptr<logs::LogWriter> writer;
  std::unique_ptr<Testbed> testbed;
  std::unique_ptr<Estimator> estimator;
  std::unique_ptr<Facility> facility;
  std::unique_ptr<LidarDriver> lidar;
  std::unique_ptr<SimulatedCell> cell;
  std::unique_ptr<ProcedureNode> node;
  SimulatedBus* operator_bus = nullptr;
  std::int64_t operator_seq = 0;
  std::vector<std::string> lines;
  std::vector<event_t> events;
  terminal::Progress progress{
      [this](const terminal::Line& line) { lines.push_back(line.rendered(false)); }};
  bool done = false;

 private:
  template <class FakeNode>
  std::unique_ptr<FakeNode> add() {
    SimulatedLoop& loop = simulation.make_loop();
    return std::make_unique<FakeNode>(script, simulation.make_bus(), loop);
  }

  template <class Message>
  void listen(const char* channel) {
    operator_bus->subscribe<Message>(channel, Queue::fifo(),
                                     [this](const Message& m) { progress.on(m); });
  }

  static inline int count = 0;
};

}  // namespace berth::fake
