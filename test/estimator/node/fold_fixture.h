// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "estimator/node/estimator.h"
#include "test/estimator/beam/packets.h"
#include "test/estimator/scan_maker.h"

namespace berth::estimator {

/// Keeps all that an estimator publishes.
struct RecordedOutput final : EstimatorOutput {
  std::vector<scan_request_t> requests;
  std::vector<pose_estimate_t> estimates;
  std::vector<estimator_state_t> states;
  std::vector<estimator_diagnostics_t> durations;
  std::vector<std::string> notes;  // codes

  void request(const scan_request_t& message) override { requests.push_back(message); }
  void estimate(const pose_estimate_t& message) override { estimates.push_back(message); }
  void state(const estimator_state_t& message) override { states.push_back(message); }
  void diagnostics(const estimator_diagnostics_t& message) override {
    durations.push_back(message);
  }
  void note(std::int8_t, const std::string& code, const std::string&) override {
    notes.push_back(code);
  }
};

/// The target's pose by default.
inline const Pose start_pose = pose_from_xyzwpr({100, -100, 5500, 10, 8, -12});

/// With the shipped configuration, or another file of its kind.
EstimatorSetup test_setup(const std::string& file = "config/estimator.yaml");

/// Sweeps a request's windows.
std::vector<ScanPacket> answer(ScanMaker& lidar, const scan_request_t& request);
ScanPacket empty_end(std::int64_t scan_id, std::int8_t status, const std::string& reason,
                     std::int64_t utime);

estimator_command_t command(std::int8_t what, std::int64_t seq, std::int64_t first_scan_id);

/// An estimator with a LIDAR that answers its last request, and the inputs on record.
struct Loopback {
  RecordedOutput output;
  Estimator estimator;
  ScanMaker lidar;
  std::vector<ScanPacket> packets;  // all that went in

  explicit Loopback(EstimatorSetup setup = test_setup(), const Mesh& mesh = replica().mesh)
      : estimator(std::move(setup), output), lidar(mesh) {}
  void send(const estimator_command_t& c) { estimator.receive(c); }
  /// Answers the outstanding request. @return false when there is none.
  bool scan_once();
  const pose_estimate_t& last() const { return output.estimates.back(); }

 private:
  std::int64_t answered_ = 0;
};

}  // namespace berth::estimator
