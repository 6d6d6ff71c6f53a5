// SPDX-License-Identifier: BSD-3-Clause
// A bridge from a vendor's SDK (vendor_sdk.h, here a stub) to Berth's LIDAR protocol
// (drivers/lidar/PROTOCOL.md). For a scanner of your own replace what calls `vendor::`.
//
//   lidar_bridge [HOST:PORT]                    (one terminal; 127.0.0.1:15024)
//   berth lidar test 127.0.0.1:15024            (another)
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

#include "common/bus/process_loop.h"
#include "common/core/error.h"
#include "drivers/lidar/connection.h"
#include "drivers/lidar/limits.h"
#include "drivers/lidar/scan_pattern.h"
#include "examples/7_lidar_bridge/vendor_sdk.h"

namespace {

using namespace berth;
using namespace berth::lidar;

/// The scanner's abilities in the protocol's terms.
LidarProfile profile_of(const vendor::Info& info) {
  LidarProfile profile;
  profile.model = info.model;
  profile.rate_hz = info.points_per_second;
  profile.beam.range_min_m = info.min_range_m;
  profile.beam.range_max_m = info.max_range_m;
  profile.field_of_view_width = radians(info.pan_span_deg);
  profile.field_of_view_height = radians(info.tilt_span_deg);
  profile.minimum_step_rad = radians(info.min_step_deg);
  profile.beams_max = 1000000;
  return profile;
}

class Bridge {
 public:
  Bridge(ProcessLoop& loop, const std::string& address)
      : loop_(loop), scanner_(vendor::Scanner::open()), profile_(profile_of(scanner_->info())) {
    listen(loop, address, [this](std::unique_ptr<Connection> host) { accept(std::move(host)); });
  }
  ~Bridge() { scanner_->stop(); }
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

 private:
  struct Scan {
    ScanOrder order;
    std::size_t window = 0;
    std::uint32_t beams = 0;
    bool over = false;
  };

  /// The newest host takes the place of the one before, and ends its scan.
  void accept(std::unique_ptr<Connection> host) {
    end_scan();
    greeted_ = false;
    host_ = std::move(host);
    host_->open([this](const Message& message) { take(message); },
                [this](const std::string& reason) { hang_up(reason); });
  }

  void hang_up(const std::string& reason) {
    end_scan();
    host_->send(Complaint{reason});
    host_.reset();
  }

  void take(const Message& message) {
    if (const auto* hello = std::get_if<Hello>(&message)) return greet(*hello);
    if (!greeted_) return hang_up("the first message must be Hello");
    if (const auto* order = std::get_if<ScanOrder>(&message)) return take_order(*order);
    if (const auto* query = std::get_if<StatusQuery>(&message)) return answer(*query);
    const auto* cancel = std::get_if<Cancel>(&message);
    if (cancel == nullptr) return hang_up("a message that only the device sends");
    if (!scanning() || cancel->scan_id != scan_->order.scan_id) return;
    end_scan();
    finish(ScanResult::cancelled);
  }

  void greet(const Hello& hello) {
    greeted_ = true;
    Identity identity = identity_of(profile_, scanner_->info().serial);
    identity.version = std::min(hello.version, protocol_version);
    host_->speak(identity.version);
    host_->send(identity);
  }

  void answer(const StatusQuery& query) {
    Status status;
    status.token = query.token;
    status.device_time = device_time(scanner_->clock_s());
    status.state = scanning() ? DeviceState::scanning : DeviceState::idle;
    if (scan_) {
      status.scan_id = scan_->order.scan_id;
      status.beams_done = scan_->beams;
    }
    host_->send(status);
  }

  void take_order(const ScanOrder& order) {
    ScanAnswer answer;
    answer.scan_id = order.scan_id;
    answer.reason = scanning() ? "a scan is running" : check_windows(profile_, order.windows);
    for (const Window& window : order.windows) {
      if (answer.reason.empty() && window.pattern != Pattern::raster) {
        answer.reason = "this scanner sweeps line by line: pattern 0 alone is possible";
      }
      answer.beams += static_cast<std::uint32_t>(beam_count(window));
    }
    answer.accepted = answer.reason.empty();
    if (!answer.accepted) answer.beams = 0;
    host_->send(answer);
    if (!answer.accepted) return;
    scan_ = Scan{order, 0, 0, false};
    start_window();
  }

  /// The SDK knows one area at a time.
  void start_window() {
    const Window& window = scan_->order.windows[scan_->window];
    const vendor::Area area{-degrees(window.azimuth), degrees(window.elevation),
                            degrees(window.width), degrees(window.height),
                            static_cast<int>(beam_count(window))};
    // Its thread hands the points to the loop; those of a scan that was ended come too late.
    const int run = ++run_;
    scanner_->start(area, [this, run](const std::vector<vendor::Point>& points, bool last) {
      loop_.post([this, run, points, last] {
        if (run == run_) send(points, last);
      });
    });
  }

  void send(const std::vector<vendor::Point>& points, bool last) {
    Returns returns;
    returns.scan_id = scan_->order.scan_id;
    returns.window = static_cast<std::uint16_t>(scan_->window);
    returns.beams_before = scan_->beams;
    returns.device_time = device_time(points.front().time_s);
    for (const vendor::Point& point : points) {
      BeamReturn beam;
      beam.after_us = static_cast<std::uint32_t>(device_time(point.time_s) - returns.device_time);
      beam.azimuth_rad = static_cast<float>(-radians(point.pan_deg));
      beam.elevation_rad = static_cast<float>(radians(point.tilt_deg));
      if (point.range_m > 0) {
        beam.status = BeamStatus::hit;
        beam.range_m = static_cast<float>(point.range_m);
        beam.intensity = static_cast<std::uint16_t>(std::lround(4095 * point.amplitude));
      }
      returns.beams.push_back(beam);
    }
    scan_->beams += static_cast<std::uint32_t>(points.size());
    host_->send(returns);
    if (!last) return;
    if (++scan_->window < scan_->order.windows.size()) return start_window();
    finish(ScanResult::complete);
  }

  void finish(ScanResult result) {
    scan_->over = true;
    host_->send(
        ScanEnd{scan_->order.scan_id, result, scan_->beams, device_time(scanner_->clock_s()), ""});
  }

  /// Ends the running scan, if any: no more points follow.
  void end_scan() {
    scanner_->stop();
    ++run_;
    if (scan_) scan_->over = true;
  }

  bool scanning() const { return scan_ && !scan_->over; }
  static std::int64_t device_time(double s) { return std::llround(1e6 * s); }

  ProcessLoop& loop_;
  std::unique_ptr<vendor::Scanner> scanner_;
  LidarProfile profile_;
  std::unique_ptr<Connection> host_;
  bool greeted_ = false;
  std::optional<Scan> scan_;
  int run_ = 0;  // of the SDK
};

}  // namespace

int main(int argc, char* argv[]) {
  const std::string address = argc > 1 ? argv[1] : "127.0.0.1:15024";
  try {
    ProcessLoop loop(clock_offset_now());
    loop.stop_on_signals();
    const Bridge bridge(loop, address);
    std::printf("listening on %s\n", address.c_str());
    std::fflush(stdout);
    loop.run();
  } catch (const InputError& e) {
    std::fprintf(stderr, "lidar_bridge: %s\n", e.what());
    return 2;
  }
  return 0;
}
