// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/facility_command_t.hpp>
#include <berth/facility_state_t.hpp>
#include <memory>
#include <string>

#include "common/bus/commands.h"
#include "common/bus/node.h"
#include "common/core/run_setup.h"
#include "drivers/devices.h"
#include "drivers/facility/plc_map.h"
#include "drivers/registers/register_link.h"

namespace berth {

/// The driver of the facility's PLC: lamps, E-stop chain, fence. Publishes FACILITY_STATE at 10 Hz
/// and when the safety chain or its own view of the PLC changes; writes the lamps of
/// FACILITY_COMMAND, and answers by FACILITY_ANSWERS when the PLC has accepted them. Safety itself
/// is the PLC's: nothing here can close a chain.
class FacilityNode final : public Node {
 public:
  FacilityNode(NodeSetup node, PlcDevice device, PlcMap map, Bus& bus, Loop& loop);
  ~FacilityNode() override;

 private:
  void on_connection(bool connected, const std::string& reason);
  void poll();
  void on_status(const RegisterAnswer& answer);
  void lose(const std::string& reason);
  void on_command(const facility_command_t& command);
  void carry_out(const facility_command_t& command);
  void refuse(const facility_command_t& command, const std::string& code, const std::string& why);
  void warn(const std::string& code, const std::string& text);
  void announce_changes(const facility_state_t& before);
  void publish();

  PlcDevice device_;
  PlcMap map_;
  facility_state_t state_{};
  bool known_ = false;  // the PLC has answered before
  struct SafetyChain {
    bool estop_closed = true;
    bool fence_closed = true;
    bool motion_enabled = true;  // or the open chain is the reason
  } seen_;                       // when the PLC was last seen
  bool read_under_way_ = false;
  int last_heartbeat_ = -1;
  int unchanged_reads_ = 0;
  Utime refused_at_ = 0;
  std::string last_refusal_;
  std::int64_t reads_missed_ = 0;
  CommandAnswers answers_;
  std::unique_ptr<RegisterLink> link_;
  Loop::TimerId poll_timer_;
  Loop::TimerId publish_timer_;
};

/// Reads devices.yaml and the register map. @throws InputError.
std::unique_ptr<Node> make_facility_node(NodeSetup node, const RunSetup& run, Bus& bus, Loop& loop);

}  // namespace berth
