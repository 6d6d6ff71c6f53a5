// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/scan_section.h"

#include <cmath>
#include <utility>

#include "app/console/view/section.h"
#include "lcmtypes/channels.h"

namespace berth::console {
namespace {

/// In whole millimetres.
void append_point(const Vector3d& point, std::string& text) {
  for (const double value : point) {
    if (!text.empty()) text += ',';
    text += std::to_string(std::llround(1e3 * value));
  }
}

Json window_json(const scan_window_t& w) {
  return {{"name", w.name},
          {"azimuth_rad", rounded(w.azimuth_rad, 1e-6)},
          {"elevation_rad", rounded(w.elevation_rad, 1e-6)},
          {"width_rad", rounded(w.width_rad, 1e-6)},
          {"height_rad", rounded(w.height_rad, 1e-6)},
          {"pattern", w.pattern},
          {"count", w.count},
          {"spacing_rad", rounded(w.spacing_rad, 1e-7)}};
}

}  // namespace

void ScanSection::begin(std::int64_t scan_id) {
  scan_id_ = scan_id;
  status_ = ScanPacket::RUNNING;
  reason_.clear();
  beams_ = 0;
  hits_ = 0;
  new_returns_.clear();
  is_new_ = true;
  changed_ = true;
}

void ScanSection::take(const logs::LogEvent& event) {
  auto request = logs::decode<scan_request_t>(event, channels::scan_request);
  if (request && request->action == scan_request_t::SCAN) {
    changed_ = true;
    request_ = std::move(request);
  }
  const auto packet = logs::decode<ScanPacket>(event, channels::scan_data);
  if (!packet) return;
  if (packet->scan_id != scan_id_) begin(packet->scan_id);
  changed_ = true;
  status_ = packet->scan_status;
  reason_ = packet->reason;
  beams_ += packet->count;
  for (std::size_t i = 0; i < packet->status.size(); ++i) {
    const auto show = [&](float range) {
      // The angles of a damaged packet may be anything.
      const Vector3d point = packet->point(i, range);
      if (!(point.norm() < 1e5)) return false;
      append_point(point, new_returns_);
      return true;
    };
    if (packet->status[i] == ScanPacket::HIT && show(packet->range_m[i])) ++hits_;
    if (packet->range2_m[i] > 0) show(packet->range2_m[i]);
  }
}

std::string ScanSection::json(const CellMessages& latest) const {
  const bool known = request_ && request_->scan_id == scan_id_;
  Json windows = Json::array();
  if (known) {
    for (const scan_window_t& window : request_->windows) windows.push_back(window_json(window));
  }
  const bool running = status_ == ScanPacket::RUNNING;
  const bool reported = latest.lidar && latest.lidar->scan_id == scan_id_;
  return text_of({{"scan_id", scan_id_},
                  {"purpose", known ? request_->purpose : ""},
                  {"status", status_},
                  {"reason", reason_},
                  {"progress", !running   ? Json(1)
                               : reported ? rounded(latest.lidar->progress, 1e-3)
                                          : Json()},
                  {"beams", beams_},
                  {"hits", hits_},
                  {"windows", windows}});
}

void ScanSection::publish(const CellMessages& latest, Sink& sink) {
  if (!std::exchange(changed_, false)) return;
  if (std::exchange(is_new_, false)) sink.reset("returns");
  sink.set("scan", json(latest));
  if (!new_returns_.empty()) sink.add("returns", std::exchange(new_returns_, {}));
}

}  // namespace berth::console
