// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/facility/facility_node.h"

#include <cmath>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr Utime publish_period = 100 * millisecond;
constexpr Utime refusal_repeat_period = second;
/// Reads with an unchanged heartbeat after which the PLC counts as dead.
constexpr int max_unchanged_reads = 10;

}  // namespace

FacilityNode::FacilityNode(NodeSetup node, PlcDevice device, PlcMap map, Bus& bus, Loop& loop)
    : Node(std::move(node), bus, loop),
      device_(std::move(device)),
      map_(map),
      answers_(bus, loop, channels::facility_answers, session()),
      link_(make_register_link(
          loop, {device_.address, map_.unit, device_.timeout, device_.dial_timeout},
          [this](bool up, const std::string& reason) { on_connection(up, reason); })) {
  state_.reason = "the PLC has not answered yet";
  bus.subscribe<facility_command_t>(
      channels::facility_command, Queue::fifo(),
      [this](const facility_command_t& command) { on_command(command); });
  poll_timer_ = loop.every(device_.poll_period, [this] { poll(); });
  publish_timer_ = loop.every(publish_period, [this] { publish(); });
  report(node_status_t::STARTING, "waiting for the PLC at " + device_.address);
}

FacilityNode::~FacilityNode() {
  loop().cancel(poll_timer_);
  loop().cancel(publish_timer_);
}

void FacilityNode::on_connection(bool connected, const std::string& reason) {
  if (connected) {
    event(event_t::INFO, "plc-connected", "PLC at " + device_.address);
  } else {
    lose(reason);
  }
}

/// Without reports of the PLC the safety chain counts as open.
void FacilityNode::lose(const std::string& reason) {
  if (state_.valid) event(event_t::WARNING, "plc-lost", "PLC: " + reason);
  const bool changed = state_.valid || state_.reason != reason;
  state_.valid = false;
  state_.reason = reason;
  state_.estop_chain_closed = state_.fence_closed = state_.motion_enabled = false;
  report(node_status_t::DEGRADED, reason);
  if (changed) publish();
}

void FacilityNode::poll() {
  if (!link_->connected()) return;
  if (read_under_way_) {
    count("reads_missed", static_cast<double>(++reads_missed_));
    return;
  }
  read_under_way_ = true;
  link_->read_registers(map_.status.first, map_.status.count, [this](const RegisterAnswer& answer) {
    read_under_way_ = false;
    on_status(answer);
  });
}

void FacilityNode::on_status(const RegisterAnswer& answer) {
  if (!answer.ok()) {
    count("reads_missed", static_cast<double>(++reads_missed_));
    return lose(answer.error);
  }
  const auto word = [&](int n) {
    return answer.words[static_cast<std::size_t>(n - map_.status.first)];
  };
  unchanged_reads_ = word(map_.heartbeat) == last_heartbeat_ ? unchanged_reads_ + 1 : 0;
  last_heartbeat_ = word(map_.heartbeat);
  if (unchanged_reads_ >= max_unchanged_reads) return lose("the PLC's heartbeat stands still");

  const facility_state_t before = state_;
  state_.valid = true;
  state_.reason.clear();
  state_.utime_sent = answer.sent;
  state_.utime_received = answer.received;
  state_.utime = answer.sent + (answer.received - answer.sent) / 2;
  state_.sun_lamp = level_from_word(word(map_.sun_lamp.status));
  state_.albedo_lamp = level_from_word(word(map_.albedo_lamp.status));
  state_.sun_azimuth_rad = angle_from_word(word(map_.sun_azimuth.status));
  state_.sun_elevation_rad = angle_from_word(word(map_.sun_elevation.status));
  const int safety = word(map_.safety);
  state_.estop_chain_closed = (safety >> map_.estop_bit & 1) != 0;
  state_.fence_closed = (safety >> map_.fence_bit & 1) != 0;
  state_.motion_enabled = (safety >> map_.motion_bit & 1) != 0;
  announce_changes(before);
  known_ = true;
  report(node_status_t::READY, state_.estop_chain_closed ? "" : "emergency stop");
}

/// Changes since the PLC's last report, however old. The first report is compared with a closed
/// chain, so that an open one is announced.
void FacilityNode::announce_changes(const facility_state_t& before) {
  const bool closed = state_.estop_chain_closed && state_.fence_closed;
  const SafetyChain now_seen{state_.estop_chain_closed != 0, state_.fence_closed != 0,
                             state_.motion_enabled || !closed};
  const SafetyChain seen = std::exchange(seen_, now_seen);
  const std::string unseen = before.valid ? "" : "; it changed while the PLC was not seen";
  const auto report_change = [&](bool was, bool is, const char* good, const std::string& good_text,
                                 const char* bad, const std::string& bad_text) {
    if (was && !is) event(event_t::ERROR, bad, bad_text + (known_ ? unseen : ""));
    if (!was && is) event(event_t::NOTICE, good, good_text + unseen);
  };
  report_change(seen.estop_closed, now_seen.estop_closed, "estop-released",
                "the E-stop chain is closed again", "estop", "the E-stop chain is open");
  report_change(seen.fence_closed, now_seen.fence_closed, "fence-closed",
                "the fence is closed again", "fence-open", "the fence is open");
  report_change(seen.motion_enabled, now_seen.motion_enabled, "motion-enabled",
                "motion is enabled again", "motion-disabled",
                "motion is not enabled although E-stop chain and fence are closed");
  if (before.valid != state_.valid || before.estop_chain_closed != state_.estop_chain_closed ||
      before.fence_closed != state_.fence_closed ||
      before.motion_enabled != state_.motion_enabled) {
    publish();
  }
}

void FacilityNode::warn(const std::string& code, const std::string& text) {
  if (code == last_refusal_ && now() - refused_at_ < refusal_repeat_period) return;
  last_refusal_ = code;
  refused_at_ = now();
  event(event_t::WARNING, code, text);
}

void FacilityNode::refuse(const facility_command_t& command, const std::string& code,
                          const std::string& why) {
  warn(code, "lamps: " + why);
  answers_.refuse(command, why);
}

void FacilityNode::on_command(const facility_command_t& command) {
  if (!answers_.is_new(command)) return;
  if (command.session != session()) {
    return refuse(command, "command-of-another-session",
                  "a command of session " + std::to_string(command.session) + " was ignored");
  }
  if (now() > command.utime_expires) {
    return refuse(command, "command-expired", "a command came after it had expired");
  }
  const auto is_level = [](double level) { return level >= 0 && level <= 1; };
  if (!is_level(command.sun_lamp) || !is_level(command.albedo_lamp) ||
      !std::isfinite(command.sun_azimuth_rad) || !std::isfinite(command.sun_elevation_rad)) {
    return refuse(command, "command-refused", "levels must be 0 to 1 and angles finite");
  }
  carry_out(command);
}

void FacilityNode::carry_out(const facility_command_t& command) {
  std::vector<Word> words(static_cast<std::size_t>(map_.command.count), 0);
  const auto at = [&](const PlcMap::Value& value) -> Word& {
    return words[static_cast<std::size_t>(value.command - map_.command.first)];
  };
  at(map_.sun_lamp) = word_from_level(command.sun_lamp);
  at(map_.albedo_lamp) = word_from_level(command.albedo_lamp);
  at(map_.sun_azimuth) = word_from_angle(command.sun_azimuth_rad);
  at(map_.sun_elevation) = word_from_angle(command.sun_elevation_rad);
  link_->write_registers(map_.command.first, words, [this, command](const RegisterAnswer& answer) {
    if (answer.ok()) return answers_.accept(command);
    warn("lamps-not-set", "lamps: " + answer.error);
    answers_.forget(command);  // a repetition is tried again
  });
}

void FacilityNode::publish() {
  state_.seq += 1;
  state_.session = session();
  if (!state_.valid) state_.utime = state_.utime_sent = state_.utime_received = now();
  bus().publish(channels::facility_state, state_);
}

std::unique_ptr<Node> make_facility_node(NodeSetup node, const RunSetup& run, Bus& bus,
                                         Loop& loop) {
  const PlcDevice device = load_devices(run.config).plc;
  const PlcMap map = PlcMap::load(run.config / "registers" / (device.registers + ".yaml"));
  return std::make_unique<FacilityNode>(std::move(node), device, map, bus, loop);
}

}  // namespace berth
