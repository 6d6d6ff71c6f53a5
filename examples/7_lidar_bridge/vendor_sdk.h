// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

/// Stands for the header of a scanner's SDK, and is like none in particular: degrees, pan to the
/// left, a clock in seconds since the scanner was switched on, calls from a thread of its own.
namespace vendor {

struct Info {
  std::string model;
  std::string serial;
  double points_per_second = 0;
  double min_range_m = 0, max_range_m = 0;
  double pan_span_deg = 0, tilt_span_deg = 0;  ///< symmetric about straight ahead
  double min_step_deg = 0;
};

struct Point {
  double time_s = 0;     ///< on the scanner's clock
  double pan_deg = 0;    ///< to the left
  double tilt_deg = 0;   ///< up
  double range_m = 0;    ///< 0: nothing came back
  double amplitude = 0;  ///< 0..1
};

struct Area {
  double pan_deg = 0, tilt_deg = 0;  ///< centre
  double pan_span_deg = 0, tilt_span_deg = 0;
  int points = 0;
};

class Scanner {
 public:
  /// Called from the SDK's thread. last: the scan is complete with these points.
  using OnPoints = std::function<void(const std::vector<Point>& points, bool last)>;

  static std::unique_ptr<Scanner> open();
  virtual ~Scanner() = default;
  virtual Info info() const = 0;
  virtual double clock_s() const = 0;
  /// One area, line by line. The one before must be over.
  virtual void start(const Area& area, OnPoints on_points) = 0;
  /// Nothing is called any more once this returns.
  virtual void stop() = 0;
};

}  // namespace vendor
