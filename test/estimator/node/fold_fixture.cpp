// SPDX-License-Identifier: BSD-3-Clause
#include "test/estimator/node/fold_fixture.h"

#include "lcmtypes/conversions.h"

namespace berth::estimator {

EstimatorSetup test_setup(const std::string& file) {
  EstimatorSetup setup;
  setup.options = load_estimator_options(file);
  setup.lidar = load_lidar_profile("config/lidars/ilris_3d.yaml");
  setup.target = "radarsat2";
  setup.session = 7;
  setup.find_model = [](const std::string& name) -> std::shared_ptr<const TargetModel> {
    if (name == "radarsat2") return replica_model();
    if (name == "cube") return cube_model();
    throw InputError("no target '" + name + "'");
  };
  setup.stopwatch = [] { return std::int64_t{0}; };
  return setup;
}

std::vector<ScanPacket> answer(ScanMaker& lidar, const scan_request_t& request) {
  lidar.utime += 50000;
  lidar.pose = moved(lidar.pose, lidar.velocity, 0.05);
  return packets_of(lidar.sweep(windows_of(request.windows)), request.scan_id, request.session);
}

ScanPacket empty_end(std::int64_t scan_id, std::int8_t status, const std::string& reason,
                     std::int64_t utime) {
  ScanPacket p{};
  p.utime = utime;
  p.scan_id = scan_id;
  p.scan_status = status;
  p.reason = reason;
  return p;
}

estimator_command_t command(std::int8_t what, std::int64_t seq, std::int64_t first_scan_id) {
  estimator_command_t c{};
  c.utime = 1735689600000000;
  c.seq = seq;
  c.session = 7;
  c.commander = "test";
  c.command = what;
  c.first_scan_id = first_scan_id;
  return c;
}

bool Loopback::scan_once() {
  if (output.requests.empty() || output.requests.back().scan_id == answered_) return false;
  answered_ = output.requests.back().scan_id;
  for (const ScanPacket& p : answer(lidar, scan_request_t(output.requests.back()))) {
    packets.push_back(p);
    estimator.receive(p);
  }
  return true;
}

}  // namespace berth::estimator
