// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/twin_host.h"

#include <malloc.h>

#include <berth/procedure_command_t.hpp>
#include <berth/procedure_state_t.hpp>
#include <chrono>
#include <map>

#include "app/exit_code.h"
#include "app/runs/own_estimator.h"
#include "app/runs/procedure_run.h"
#include "app/terminal/procedure_client.h"
#include "common/bus/simulation.h"
#include "common/core/config.h"
#include "drivers/arm/arm_node.h"
#include "drivers/facility/facility_node.h"
#include "drivers/lidar/lidar_node.h"
#include "drivers/simulated/simulated_cell.h"
#include "estimator/node/estimator_node.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_writer.h"
#include "testbed/node/testbed_node.h"

namespace berth {
namespace {

double wall_clock() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Aborts, and answers prompts with what was given beforehand.
class TwinOperator {
 public:
  TwinOperator(Bus& bus, Loop& loop, std::int64_t session,
               std::map<std::string, std::string> answers)
      : client_(bus, loop, session, "operator"), answers_(std::move(answers)) {
    bus.subscribe<procedure_state_t>(channels::procedure_state, Queue::fifo(),
                                     [this](const procedure_state_t& state) { answer(state); });
  }

  void send(std::int8_t what, const std::string& prompt_id, const std::string& text) {
    procedure_command_t command{};
    command.command = what;
    command.prompt_id = prompt_id;
    command.text = text;
    client_.send(command);
  }

 private:
  void answer(const procedure_state_t& state) {
    if (state.prompt_id.empty()) answered_.clear();
    if (state.state != procedure_state_t::PROMPTING || answered_ == state.prompt_id) return;
    answered_ = state.prompt_id;
    auto answer = answers_.find(state.prompt_id);
    if (answer == answers_.end() && state.current_step >= 0) {
      answer = answers_.find(state.steps[static_cast<std::size_t>(state.current_step)].name);
    }
    if (answer != answers_.end()) {
      send(procedure_command_t::ANSWER, state.prompt_id, answer->second);
    }
  }

  ProcedureClient client_;
  std::map<std::string, std::string> answers_;
  std::string answered_;  // prompt
};

/// Memory given back to the system between two scans comes back page by page, each of them cleared.
void keep_memory() {
#ifdef __GLIBC__
  mallopt(M_TRIM_THRESHOLD, 512 << 20);
  mallopt(M_MMAP_THRESHOLD, 64 << 20);
#endif
}

/// The longest procedure that is believed in: a stuck one ends here.
constexpr Utime time_limit = 24 * 3600LL * second;

}  // namespace

std::map<std::string, Utime> compute_delays(const std::filesystem::path& config) {
  Config file = Config::load(config / "twin.yaml");
  std::map<std::string, Utime> delays;
  for (const auto& [node, delay] :
       file.section("compute_delay").named_quantities(Dimension::time)) {
    delays[node] = utime_from_seconds(delay);
  }
  file.finish();
  return delays;
}

TwinResult run_twin(const RunFiles& files,
                    const std::function<void(const std::string&, Bytes)>& watch,
                    const std::function<bool()>& abort_requested,
                    const std::map<std::string, std::string>& answers) {
  keep_memory();
  TwinResult result;
  const double begin = wall_clock();
  const auto delays = compute_delays(files.setup.config);
  Simulation simulation;
  const auto delay_of = [&](const std::string& name) -> Utime {
    const auto delay = delays.find(name);
    return delay == delays.end() ? 0 : delay->second;
  };
  const auto setup = [&](const std::string& name) {
    return NodeSetup{name, files.setup.session, files.configuration_hash, delay_of(name)};
  };
  struct Place {
    Bus& bus;
    Loop& loop;
  };
  const auto place_of = [&](const std::string& name) {
    SimulatedLoop& loop = simulation.make_loop();
    return Place{simulation.make_bus(delay_of(name)), loop};
  };
  const RunSetup& run = files.setup;

  std::vector<std::unique_ptr<Node>> nodes;
  const Place cell = place_of("simulated-cell");
  nodes.push_back(make_simulated_cell(setup("simulated-cell"), run, cell.bus, cell.loop));
  for (const ArmRole role : {ArmRole::replica, ArmRole::sensor}) {
    const std::string name = std::string("arm-driver-") + name_of(role);
    const Place arm = place_of(name);
    nodes.push_back(make_arm_node(setup(name), run, role, arm.bus, arm.loop));
  }
  const Place lidar = place_of("lidar-driver");
  nodes.push_back(make_lidar_node(setup("lidar-driver"), run, lidar.bus, lidar.loop));
  const Place facility = place_of("facility-driver");
  nodes.push_back(make_facility_node(setup("facility-driver"), run, facility.bus, facility.loop));
  const Place testbed = place_of("testbed");
  nodes.push_back(make_testbed_node(setup("testbed"), run, testbed.bus, testbed.loop));
  const Place estimator = place_of("estimator");
  const EstimatorMaker make_estimator =
      files.estimator.empty() ? make_estimator_node : load_own_estimator(files.estimator);
  nodes.push_back(make_estimator(setup("estimator"), run, estimator.bus, estimator.loop));
  const Place engine = place_of("procedure");
  const auto procedure =
      make_procedure_node(setup("procedure"), run, procedure_run(files), engine.bus, engine.loop);
  bool finished = false;
  procedure->when_finished([&] { finished = true; });

  logs::LogWriter log(files.log());
  Utime flushed = simulation.now();
  simulation.record([&](Utime utime, const std::string& channel, Bytes bytes) {
    log.write(utime, channel, bytes);
    // What was recorded outlives this process.
    if (utime - flushed >= second) {
      log.flush();
      flushed = utime;
    }
    watch(channel, bytes);
  });

  TwinOperator person(simulation.make_bus(), simulation.make_loop(), run.session, answers);
  bool abort_sent = false;
  const auto done = [&] {
    if (!abort_sent && abort_requested()) {
      abort_sent = true;
      person.send(procedure_command_t::ABORT, "", "interrupted by the operator");
    }
    return finished;
  };

  const Utime start = simulation.now();
  const double prepared = wall_clock();
  simulation.run_until(done, start + time_limit);
  simulation.run_for(200 * millisecond);  // last words
  result.preparation_s = prepared - begin;
  result.wall_s = wall_clock() - prepared;
  result.simulated_s = seconds(simulation.now() - start);
  log.flush();
  result.exit_code = finished ? procedure->exit_code() : exit_code::error;
  return result;
}

}  // namespace berth
