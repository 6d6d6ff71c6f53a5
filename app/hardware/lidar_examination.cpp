// SPDX-License-Identifier: BSD-3-Clause
#include "app/hardware/lidar_examination.h"

#include <cmath>

#include "app/hardware/clock_finding.h"
#include "common/core/text.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/limits.h"

namespace berth {
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
        "not asked: it serves one host, and the driver of " + used_by_ + " is connected";
    finding.remedy = "that driver has checked who answers; berth stop, and again, to see it here";
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
  const auto differs = [&](const std::string& what, double found, double wanted) {
    if (same(found, wanted) || finding.state != State::good) return;
    finding.state = State::warning;
    finding.found += "; its " + what + " is " + shown(found) + ", the profile has " + shown(wanted);
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

}  // namespace berth
