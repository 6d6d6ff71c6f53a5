// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "app/runs/run_files.h"
#include "common/bus/simulation.h"
#include "estimator/node/estimator_node.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_writer.h"
#include "procedures/engine/run_info.h"
#include "procedures/language/procedure.h"
#include "test/estimator/node/fold_fixture.h"
#include "test/evaluation/measure/made_run.h"

namespace berth::made {

/// A run of some 20 s: the estimator's node acquires and tracks a replica that stands still, seen
/// by a small LIDAR; truth, RUN_INFO and a finished procedure of two phases are in the log.
inline RunFiles record_run(const std::filesystem::path& out, std::uint64_t seed = 1) {
  RunRequest request;
  request.procedure = "procedures/track_static.yaml";
  request.host = "twin";
  request.seed = seed;
  request.out = out;
  const RunFiles files = RunFiles::create(request);

  Simulation::Options options;
  options.start = start;
  Simulation simulation(options);
  logs::LogWriter log(files.log());
  simulation.record([&](Utime utime, const std::string& channel, Bytes bytes) {
    log.write(utime, channel, bytes);
  });
  SimulatedBus& bus = simulation.make_bus(30 * millisecond);
  const auto node =
      make_estimator_node({"estimator", files.setup.session, files.configuration_hash}, files.setup,
                          bus, simulation.make_loop());

  SimulatedLoop& loop = simulation.make_loop();
  SimulatedBus& other = simulation.make_bus();
  estimator::ScanMaker lidar(estimator::replica().mesh, seed);
  lidar.pose = pose_from_xyzwpr({100, -100, 5500, 10, 8, -12});
  std::int64_t answered = 0;
  other.subscribe<scan_request_t>(
      channels::scan_request, Queue::fifo(), [&](const scan_request_t& request_message) {
        if (request_message.scan_id == answered) return;
        answered = request_message.scan_id;
        lidar.utime = loop.now();
        for (const auto& p : estimator::answer(lidar, request_message)) {
          loop.at(p.utime + p.time_us.back(),
                  [&other, p] { other.publish(channels::scan_data, p); });
        }
      });
  const auto send_command = [&](std::int8_t what, std::int64_t seq) {
    estimator_command_t command = estimator::command(what, seq, answered + 2);
    command.utime = loop.now();
    command.session = files.setup.session;
    other.publish(channels::estimator_command, command);
  };
  loop.after(1 * second, [&] { send_command(estimator_command_t::ACQUIRE, 1); });
  loop.after(8 * second, [&] { send_command(estimator_command_t::TRACK, 2); });
  loop.every(8 * millisecond, [&] {
    ground_truth_t message = truth(loop.now(), lidar.pose);
    message.session = files.setup.session;
    other.publish(channels::ground_truth, message);
  });
  loop.after(second / 2, [&] {
    run_info_t info = procedures::make_run_info(procedures::load_procedure(files.procedure(), {}),
                                                files.setup, estimator::replica(), files.name,
                                                run_info_t::TWIN, files.configuration_hash);
    info.utime = loop.now();
    other.publish(channels::run_info, info);
  });
  loop.after(20 * second, [&] {
    procedure_state_t message = state({{"acquire", 1, 8}, {"track", 8, 19}});
    message.session = files.setup.session;
    other.publish(channels::procedure_state, message);
  });
  simulation.run_for(20 * second + 100 * millisecond);
  return files;
}

}  // namespace berth::made
