// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/lidar_node.h"

#include <algorithm>
#include <berth/lidar_state_t.hpp>

#include "drivers/devices.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/limits.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"

namespace berth {
namespace {

constexpr Utime state_period = 500 * millisecond;
constexpr Utime repeat_period = 1 * second;

static_assert(lidar::max_beams_per_message * 49 + 1000 <= Bus::max_message_bytes,
              "a packet of SCAN_DATA is one datagram");

void fill(ScanPacket& packet, std::size_t i, const lidar::BeamReturn& beam, std::int32_t time_us) {
  const auto intensity = [](std::uint16_t value) {
    return static_cast<std::int16_t>(std::min<int>(value, 4095));
  };
  packet.time_us[i] = time_us;
  packet.origin_x_m[i] = beam.origin_m[0];
  packet.origin_y_m[i] = beam.origin_m[1];
  packet.origin_z_m[i] = beam.origin_m[2];
  packet.azimuth_rad[i] = beam.azimuth_rad;
  packet.elevation_rad[i] = beam.elevation_rad;
  packet.status[i] = static_cast<std::int8_t>(beam.status);
  packet.ambient[i] = beam.ambient;
  packet.range_m[i] = beam.range_m;
  packet.range_sigma_m[i] = beam.range_sigma_m;
  packet.intensity[i] = intensity(beam.intensity);
  packet.range2_m[i] = beam.range2_m;
  packet.range2_sigma_m[i] = beam.range2_sigma_m;
  packet.intensity2[i] = intensity(beam.intensity2);
}

}  // namespace

LidarNode::LidarNode(NodeSetup setup, LidarNodeConfig config,
                     std::unique_ptr<lidar::Adapter> adapter, Bus& bus, Loop& loop)
    : Node(std::move(setup), bus, loop), config_(std::move(config)), device_(std::move(adapter)) {
  this->bus().subscribe<scan_request_t>(
      channels::scan_request, Queue::fifo(),
      [this](const scan_request_t& request) { take_request(request); });
  tick_timer_ = loop.every(state_period, [this] { tick(); });
  report(node_status_t::STARTING, "waiting for the LIDAR at " + device_->name());
  device_->start(
      {[this] {
         was_ready_ = true;
         report(node_status_t::READY);
         event(event_t::INFO, "lidar-connected",
               device_->identity().model + " " + device_->identity().serial + " at " +
                   device_->name());
         publish_state();
       },
       [this](const lidar::Message& message) { take_message(message); },
       [this](const std::string& reason) { lost(reason); },
       [this](const std::string& what) { event(event_t::WARNING, "lidar-trouble", what); }});
}

LidarNode::~LidarNode() { loop().cancel(tick_timer_); }

void LidarNode::take_request(const scan_request_t& request) {
  if (request.session != session()) {
    if (request.session == foreign_session_) return;
    foreign_session_ = request.session;
    return event(event_t::WARNING, "foreign-session",
                 "scan request of session " + std::to_string(request.session) + ", this is " +
                     std::to_string(session()) + ": not obeyed");
  }
  if (request.action == scan_request_t::CANCEL) return cancel(request);
  if (request.scan_id == last_requested_) return;  // a repeat
  if (request.scan_id < last_requested_) {
    return event(event_t::NOTICE, "stale-scan-request",
                 "scan " + std::to_string(request.scan_id) + " was requested after scan " +
                     std::to_string(last_requested_) + ": not obeyed");
  }
  last_requested_ = request.scan_id;
  if (!scan_) return start(request);
  // The newer request waits until the device has ended the older scan.
  pending_ = request;
  if (!scan_->cancelling) device_->cancel(scan_->request.scan_id);
  scan_->cancelling = true;
}

void LidarNode::cancel(const scan_request_t& request) {
  if (pending_ && pending_->scan_id == request.scan_id) pending_.reset();
  if (!scan_ || scan_->request.scan_id != request.scan_id || scan_->cancelling) return;
  scan_->cancelling = true;
  device_->cancel(request.scan_id);
}

std::string LidarNode::refusal(const scan_request_t& request) const {
  if (!device_->ready()) return "the LIDAR is offline: " + device_->reason();
  if (!device_fault_.empty()) return "the LIDAR reports a fault: " + device_fault_;
  return lidar::check_windows(config_.profile, windows_of(request.windows));
}

void LidarNode::start(const scan_request_t& request) {
  scan_ = Scan();
  scan_->request = request;
  scan_->began = now();
  const std::string why = refusal(request);
  if (!why.empty()) return finish(ScanPacket::REFUSED, why, now());
  scan_->clock = device_->clock();
  device_->order({request.scan_id, windows_of(request.windows)});
  publish_state();
}

void LidarNode::take_message(const lidar::Message& message) {
  if (const auto* status = std::get_if<lidar::Status>(&message)) {
    const std::string fault =
        status->state == lidar::DeviceState::fault ? "fault: " + status->reason : "";
    if (fault == device_fault_) return;
    device_fault_ = fault;
    report(fault.empty() ? node_status_t::READY : node_status_t::FAULT, fault);
    publish_state();
  } else if (const auto* answer = std::get_if<lidar::ScanAnswer>(&message)) {
    if (!scan_ || answer->scan_id != scan_->request.scan_id) return;
    scan_->beams_total = answer->beams;
    if (!answer->accepted) {
      finish(ScanPacket::REFUSED, "the LIDAR refuses: " + answer->reason, now());
    }
  } else if (const auto* returns = std::get_if<lidar::Returns>(&message)) {
    take_returns(*returns);
  } else if (const auto* end = std::get_if<lidar::ScanEnd>(&message)) {
    take_end(*end);
  }
}

ScanPacket LidarNode::packet_of(const Scan& scan) const {
  ScanPacket packet{};
  packet.session = session();
  packet.scan_id = scan.request.scan_id;
  packet.packet = scan.packets;
  packet.beams_before = static_cast<std::int32_t>(scan.beams);
  return packet;
}

void LidarNode::take_returns(const lidar::Returns& returns) {
  if (!scan_ || returns.scan_id != scan_->request.scan_id) return;
  if (returns.beams_before != scan_->beams || returns.window >= scan_->request.windows.size()) {
    return device_->drop("returns of the LIDAR do not follow one another");
  }
  const auto max_beams =
      static_cast<std::size_t>(lidar::packet_size(config_.profile, config_.beams_per_packet));
  for (std::size_t first = 0; first < returns.beams.size();) {
    const std::size_t count = std::min(returns.beams.size() - first, max_beams);
    const std::uint32_t base = returns.beams[first].after_us;
    ScanPacket packet = packet_of(*scan_);
    packet.scan_status = ScanPacket::RUNNING;
    packet.window = static_cast<std::int16_t>(returns.window);
    packet.utime = scan_->clock.to_host(returns.device_time + base);
    packet.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const lidar::BeamReturn& beam = returns.beams[first + i];
      fill(packet, i, beam, static_cast<std::int32_t>(beam.after_us - base));
    }
    if (packet.utime > now() + lidar::clock_tolerance ||
        packet.utime < scan_->began - lidar::clock_tolerance) {
      event(event_t::ERROR, "lidar-clock",
            "a beam's time stamp lies outside the scan by the mapped clock");
      return device_->drop("time stamps of the LIDAR make no sense");
    }
    scan_->beams += static_cast<std::uint32_t>(count);
    ++scan_->packets;
    first += count;
    publish(packet);
  }
}

void LidarNode::take_end(const lidar::ScanEnd& end) {
  if (!scan_ || end.scan_id != scan_->request.scan_id) return;
  const Utime when = scan_->clock.to_host(end.device_time);
  if (end.result == lidar::ScanResult::complete && end.beams == scan_->beams) {
    finish(ScanPacket::COMPLETE, "", when);
  } else if (end.result == lidar::ScanResult::cancelled) {
    finish(ScanPacket::ABORTED,
           pending_ ? "replaced by scan " + std::to_string(pending_->scan_id) : "cancelled", when);
  } else {
    finish(ScanPacket::ABORTED,
           end.reason.empty() ? "the LIDAR lost returns" : "the LIDAR fails: " + end.reason, when);
  }
}

void LidarNode::finish(std::int8_t status, const std::string& reason, Utime when) {
  ScanPacket packet = packet_of(*scan_);
  packet.utime = when;
  packet.scan_status = status;
  packet.reason = reason;
  packet.window = static_cast<std::int16_t>(std::max(scan_->request.window_count - 1, 0));
  last_progress_ = status == ScanPacket::COMPLETE ? 1
                   : scan_->beams_total == 0
                       ? 0
                       : static_cast<double>(scan_->beams) / scan_->beams_total;
  scan_.reset();
  publish(packet);
  last_ = std::move(packet);
  last_published_ = now();
  count("scans", static_cast<double>(++scans_));
  if (!reason.empty()) {
    event(event_t::WARNING, status == ScanPacket::REFUSED ? "scan-refused" : "scan-aborted",
          "scan " + std::to_string(last_->scan_id) + ": " + reason);
  }
  publish_state();
  start_pending();
}

void LidarNode::start_pending() {
  if (!pending_) return;
  const scan_request_t request = std::move(*pending_);
  pending_.reset();
  start(request);
}

void LidarNode::lost(const std::string& reason) {
  device_fault_.clear();
  // Before the first connection the device may still be starting.
  report(was_ready_ ? node_status_t::FAULT : node_status_t::STARTING, reason);
  event(was_ready_ ? event_t::ERROR : event_t::NOTICE, "lidar-offline", reason);
  if (scan_) return finish(ScanPacket::ABORTED, reason, now());
  publish_state();
}

void LidarNode::tick() {
  if (!scan_ && last_ && now() - last_published_ >= repeat_period) {
    publish(*last_);
    last_published_ = now();
  }
  publish_state();
}

void LidarNode::publish(ScanPacket& packet) {
  packet.seq = ++packet_seq_;
  bus().publish(channels::scan_data, packet);
}

void LidarNode::publish_state() {
  lidar_state_t state{};
  state.utime = now();
  state.seq = ++state_seq_;
  state.session = session();
  state.state = !device_->ready()        ? lidar_state_t::OFFLINE
                : !device_fault_.empty() ? lidar_state_t::FAULT
                : scan_                  ? lidar_state_t::SCANNING
                                         : lidar_state_t::IDLE;
  state.reason = device_->ready() ? device_fault_ : device_->reason();
  if (state.state == lidar_state_t::IDLE && last_ && !last_->reason.empty()) {
    state.reason = "scan " + std::to_string(last_->scan_id) + ": " + last_->reason;
  }
  state.model = config_.profile.model;
  state.serial = device_->ready() ? device_->identity().serial : "";
  state.scan_id = scan_ ? scan_->request.scan_id : last_ ? last_->scan_id : 0;
  state.progress = !scan_ ? last_progress_
                   : scan_->beams_total == 0
                       ? 0
                       : static_cast<double>(scan_->beams) / scan_->beams_total;
  if (device_->ready()) {
    const ClockLine clock = device_->clock();
    state.clock_offset_s = seconds(clock.offset);
    state.clock_offset_sigma_s = clock.sigma_s;
  }
  state.rate_hz = config_.profile.rate_hz;
  state.range_min_m = config_.profile.beam.range_min_m;
  state.range_max_m = config_.profile.beam.range_max_m;
  state.field_of_view_rad[0] = config_.profile.field_of_view_width;
  state.field_of_view_rad[1] = config_.profile.field_of_view_height;
  bus().publish(channels::lidar_state, state);
}

std::unique_ptr<Node> make_lidar_node(NodeSetup setup, const RunSetup& run, Bus& bus, Loop& loop) {
  const LidarDevice device = load_devices(run.config).lidar;
  LidarNodeConfig config;
  config.profile = load_lidar_profile(run, device.model);
  auto adapter = lidar::make_adapter(device, config.profile, loop);
  return std::make_unique<LidarNode>(std::move(setup), std::move(config), std::move(adapter), bus,
                                     loop);
}

}  // namespace berth
