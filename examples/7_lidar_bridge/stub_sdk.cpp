// SPDX-License-Identifier: BSD-3-Clause
// A scanner that is not there: a sphere of 1 m, 8 m ahead, before a wall 12 m away.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <thread>

#include "examples/7_lidar_bridge/vendor_sdk.h"

namespace vendor {
namespace {

constexpr double rate = 4000;  // points per second
constexpr int block = 40;      // points of one call: 10 ms
constexpr double radians = M_PI / 180;

double range_of(double pan_deg, double tilt_deg) {
  const double z = std::cos(tilt_deg * radians) * std::cos(pan_deg * radians);  // of the ray
  constexpr double distance = 8;
  constexpr double radius = 1;
  // The ray meets the sphere where r^2 - 2 r distance z + distance^2 = radius^2.
  const double half = distance * z;
  const double under = half * half - distance * distance + radius * radius;
  return under >= 0 ? half - std::sqrt(under) : 12 / z;
}

class Stub final : public Scanner {
 public:
  ~Stub() override { Stub::stop(); }
  Info info() const override { return {"Stub S1", "0001", rate, 1, 100, 60, 60, 0.005}; }
  double clock_s() const override {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - switched_on_).count();
  }
  void start(const Area& area, OnPoints on_points) override {
    stop();
    stopped_ = false;
    thread_ = std::thread([this, area, on_points] { scan(area, on_points); });
  }
  void stop() override {
    stopped_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  void scan(const Area& area, const OnPoints& on_points) {
    const double aspect = area.tilt_span_deg > 0 ? area.pan_span_deg / area.tilt_span_deg : 1;
    const int columns = std::max(1, static_cast<int>(std::ceil(std::sqrt(area.points * aspect))));
    const int rows = (area.points + columns - 1) / columns;
    const double begin = clock_s();
    std::vector<Point> points;
    for (int i = 0; i < area.points; ++i) {
      if (stopped_) return;
      Point point;
      point.time_s = begin + i / rate;
      const double u = (i % columns + 0.5) / columns - 0.5;
      const double v = 0.5 - (i / columns + 0.5) / rows;
      point.pan_deg = area.pan_deg + u * area.pan_span_deg;
      point.tilt_deg = area.tilt_deg + v * area.tilt_span_deg;
      point.range_m = range_of(point.pan_deg, point.tilt_deg);
      point.amplitude = 0.5;
      points.push_back(point);
      if (static_cast<int>(points.size()) < block && i + 1 < area.points) continue;
      std::this_thread::sleep_for(std::chrono::duration<double>(point.time_s - clock_s()));
      on_points(points, i + 1 == area.points);
      points.clear();
    }
  }

  const std::chrono::steady_clock::time_point switched_on_ = std::chrono::steady_clock::now();
  std::atomic<bool> stopped_ = true;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Scanner> Scanner::open() { return std::make_unique<Stub>(); }

}  // namespace vendor
