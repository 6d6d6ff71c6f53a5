// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/scan_request_t.hpp>
#include <memory>
#include <optional>
#include <string>

#include "common/bus/node.h"
#include "common/core/lidar_profile.h"
#include "common/core/run_setup.h"
#include "drivers/lidar/adapter.h"
#include "lcmtypes/scan_packet.h"

namespace berth {

struct LidarNodeConfig {
  LidarProfile profile;
  int beams_per_packet = 50;  ///< of SCAN_DATA, one window each; see lidar::packet_size
};

/// The LIDAR driver. SCAN_REQUEST in; SCAN_DATA while the scan runs, and LIDAR_STATE out.
///
/// A request of another session is reported and not obeyed. One outside the profile's limits, or
/// made while the device is offline, is answered with one REFUSED packet and a reason. A repeated
/// request (same scan id) is not scanned again; a newer one takes the place of a scan that still
/// runs, which ends as ABORTED. Every scan ends with an empty packet that is not RUNNING; while no
/// scan runs it is published again every second, so that a lost datagram stalls no client.
class LidarNode final : public Node {
 public:
  LidarNode(NodeSetup setup, LidarNodeConfig config, std::unique_ptr<lidar::Adapter> adapter,
            Bus& bus, Loop& loop);
  ~LidarNode() override;

 private:
  struct Scan {
    scan_request_t request;
    ClockLine clock;  ///< one for the whole scan: no step between its beams
    std::uint32_t beams_total = 0;
    std::uint32_t beams = 0;
    std::int32_t packets = 0;
    Utime began = 0;
    bool cancelling = false;
  };

  void take_request(const scan_request_t& request);
  void cancel(const scan_request_t& request);
  void start(const scan_request_t& request);
  std::string refusal(const scan_request_t& request) const;
  void take_message(const lidar::Message& message);
  void take_returns(const lidar::Returns& returns);
  void take_end(const lidar::ScanEnd& end);
  void lost(const std::string& reason);
  void finish(std::int8_t status, const std::string& reason, Utime when);
  void start_pending();
  void tick();
  void publish(ScanPacket& packet);
  void publish_state();
  ScanPacket packet_of(const Scan& scan) const;

  LidarNodeConfig config_;
  std::unique_ptr<lidar::Adapter> device_;
  std::optional<Scan> scan_;
  std::optional<scan_request_t> pending_;
  std::int64_t last_requested_ = 0;
  std::int64_t foreign_session_ = 0;  // last one reported
  std::optional<ScanPacket> last_;    // of the last scan
  Utime last_published_ = 0;
  double last_progress_ = 0;
  std::string device_fault_;
  bool was_ready_ = false;
  std::int64_t packet_seq_ = 0;
  std::int64_t state_seq_ = 0;
  std::int64_t scans_ = 0;
  Loop::TimerId tick_timer_ = 0;
};

/// Reads devices.yaml and the LIDAR's profile from RunSetup::config; behind the node is the adapter
/// chosen there. @throws InputError, also when there is nothing to play back.
std::unique_ptr<Node> make_lidar_node(NodeSetup setup, const RunSetup& run, Bus& bus, Loop& loop);

}  // namespace berth
