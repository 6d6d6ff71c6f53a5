// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor/hardware.h"

#include <cmath>

#include "app/doctor/arm_examination.h"
#include "app/doctor/finding.h"
#include "app/runs/active_runs.h"
#include "app/runs/run_files.h"
#include "common/bus/process_loop.h"
#include "common/core/config.h"
#include "common/core/text.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/limits.h"

namespace berth {

using State = Finding::State;

PlcExamination::PlcExamination(const PlcDevice& device, const PlcMap& map, Loop& loop)
    : map_(map),
      plc_({.device = "PLC",
            .options = {device.address, map.unit, device.timeout, device.dial_timeout},
            .first = map.status.first,
            .count = map.status.count,
            .period = device.poll_period,
            .when_unreachable = "is the PLC on, its Modbus TCP server running, the address that "
                                "of devices.yaml?",
            .when_silent = "is its program running; unit " + std::to_string(map.unit) +
                           " and registers " + std::to_string(map.status.first) + " to " +
                           std::to_string(map.status.first + map.status.count - 1) +
                           " of the map against the PLC's"},
           loop, [this](const RegisterAnswer& answer) { on_status(answer); }) {}

void PlcExamination::on_status(const RegisterAnswer& answer) {
  const auto at = static_cast<std::size_t>(map_.heartbeat - map_.status.first);
  if (!words_.empty() && words_[at] != answer.words[at]) ++beats_;
  words_ = answer.words;
}

std::vector<Finding> PlcExamination::findings() const {
  if (words_.empty()) return {plc_.connection()};
  return {connection(), plc_.timing(), chain()};
}

Finding PlcExamination::connection() const {
  Finding finding = plc_.connection();
  if (beats_ > 0) {
    finding.found += ", its heartbeat counts";
  } else {
    finding.state = State::bad;
    finding.found += ", but its heartbeat stands still";
    finding.remedy =
        "is its program running, and counts register " + std::to_string(map_.heartbeat) + " up?";
  }
  return finding;
}

Finding PlcExamination::chain() const {
  const int safety = words_[static_cast<std::size_t>(map_.safety - map_.status.first)];
  const auto is_set = [&](int bit) { return (safety >> bit & 1) != 0; };
  Finding finding;
  finding.subject = "PLC safety chain";
  finding.found = std::string("E-stop chain ") + (is_set(map_.estop_bit) ? "closed" : "open") +
                  ", fence " + (is_set(map_.fence_bit) ? "closed" : "open") + ", motion " +
                  (is_set(map_.motion_bit) ? "enabled" : "not enabled");
  if (is_set(map_.estop_bit) && is_set(map_.fence_bit) && is_set(map_.motion_bit)) return finding;
  finding.state = State::warning;
  finding.remedy = "nothing moves until all three are so; if they are: the bits of the map";
  return finding;
}

namespace {

using State = Finding::State;

/// Two numbers of a data sheet, typed in twice.
bool same(double a, double b) { return std::abs(a - b) <= 1e-3 * std::abs(b); }

}  // namespace

LidarExamination::LidarExamination(LidarDevice device, LidarProfile profile, std::string used_by,
                                   Loop& loop)
    : device_(std::move(device)), profile_(std::move(profile)), used_by_(std::move(used_by)) {
  if (device_.adapter != LidarDevice::Kind::tcp || !used_by_.empty()) return;
  adapter_ = lidar::make_adapter(device_, profile_, loop);
  adapter_->start({[] {}, [](const lidar::Message&) {}, [](const std::string&) {}});
}

std::vector<Finding> LidarExamination::findings(Utime span) const {
  std::vector<Finding> list{identity()};
  if (!adapter_ || !adapter_->ready()) return list;
  const ClockLine line = adapter_->clock();
  const auto bracket = static_cast<Utime>(1e6 * line.sigma_s * std::sqrt(12.0));
  list.push_back(clock_finding("LIDAR", line, 0, bracket, span));
  return list;
}

Finding LidarExamination::identity() const {
  Finding finding;
  finding.subject = "LIDAR identity";
  if (!used_by_.empty()) {
    finding.state = State::warning;
    finding.found =
        "not examined: it serves one host, and the driver of " + used_by_ + " is connected";
    finding.remedy = "that driver has checked its identity; berth stop, and again, to see it here";
    return finding;
  }
  if (!adapter_) {
    finding.state = State::warning;
    finding.found = "devices.yaml plays a recording: " + device_.recording.string();
    finding.remedy = "adapter: tcp for a device";
    return finding;
  }
  if (!adapter_->ready()) {
    finding.state = State::bad;
    finding.found = device_.address + ": " + adapter_->reason();
    finding.remedy =
        "the device or its bridge at that address; lidar.model of devices.yaml, the "
        "layout's lidar";
    return finding;
  }
  const lidar::Identity& is = adapter_->identity();
  const lidar::Identity expected = lidar::identity_of(profile_, is.serial);
  finding.found = is.model + ", serial " + is.serial + ", protocol version " +
                  std::to_string(is.version) + " at " + device_.address;
  const auto differs = [&](const std::string& what, double found, double profile_value) {
    if (same(found, profile_value) || finding.state != State::good) return;
    finding.state = State::warning;
    finding.found +=
        "; its " + what + " is " + shown(found) + ", the profile has " + shown(profile_value);
    finding.remedy = "config/lidars: the numbers of the device that is there";
  };
  differs("rate (1/s)", is.rate_hz, expected.rate_hz);
  differs("shortest range (m)", is.range_min_m, expected.range_min_m);
  differs("longest range (m)", is.range_max_m, expected.range_max_m);
  differs("field of view (rad)", is.field_of_view_rad[0], expected.field_of_view_rad[0]);
  differs("field of view's height (rad)", is.field_of_view_rad[1], expected.field_of_view_rad[1]);
  differs("least step (rad)", is.minimum_step_rad, expected.minimum_step_rad);
  return finding;
}

namespace {

/// The run of this user whose configuration has the LIDAR's address; empty: none.
std::string user_of(const LidarDevice& lidar) {
  for (const ActiveRun& run : active_runs()) {
    const RunFiles files = RunFiles::open(run.directory);
    if (load_devices(files.setup.config).lidar.address == lidar.address) {
      return run.directory.string();
    }
  }
  return "";
}

}  // namespace

std::vector<Finding> examine_hardware(const RunSetup& setup, Utime span) {
  const Devices devices = load_devices(setup.config);
  const auto map_file = [&](const std::string& name) {
    return setup.config / "registers" / (name + ".yaml");
  };
  ProcessLoop loop(clock_offset_now());
  const auto arm = [&](ArmRole role) {
    const ArmDevice& device = devices.arm(role);
    Config layout = Config::load(setup.layout_file());
    return std::make_unique<ArmExamination>(
        ArmExamination::Setup{
            role, device, RegisterMap::load(map_file(device.registers)),
            ArmKinematics::load(setup.config / layout.section(name_of(role)).text("arm"))},
        loop);
  };
  const auto replica = arm(ArmRole::replica);
  const auto sensor = arm(ArmRole::sensor);
  PlcExamination plc(devices.plc, PlcMap::load(map_file(devices.plc.registers)), loop);
  LidarExamination lidar(devices.lidar, load_lidar_profile(setup, devices.lidar.model),
                         user_of(devices.lidar), loop);
  loop.after(span, [&] { loop.stop(); });
  loop.run();

  std::vector<Finding> list = replica->findings(span);
  for (const auto& more : {sensor->findings(span), plc.findings(), lidar.findings(span)}) {
    list.insert(list.end(), more.begin(), more.end());
  }
  return list;
}

}  // namespace berth
