// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "common/bus/loop.h"
#include "lcmtypes/scan_packet.h"

namespace berth::logs {

/// One return: m, in the frame of its cloud.
struct ScanPoint {
  float x = 0;
  float y = 0;
  float z = 0;
  float intensity = 0;      ///< 0..4095
  float range_sigma = 0;    ///< m; 0: not reported
  float ambient = 0;        ///< background light of its beam, on the scale of intensity
  float return_number = 1;  ///< 2: the second return of its beam
  double utime = 0;         ///< us since the epoch, whole
};

/// The fields of a ScanPoint before utime, in their order.
inline constexpr std::array point_fields = {
    "x", "y", "z", "intensity", "range_sigma", "ambient", "return_number"};
inline std::array<float, point_fields.size()> floats_of(const ScanPoint& p) {
  return {p.x, p.y, p.z, p.intensity, p.range_sigma, p.ambient, p.return_number};
}

/// All returns of one scan, those of a beam one after the other. Sensor frame, unless `frame` names
/// another.
struct ScanCloud {
  std::int64_t session = 0;
  std::int64_t scan_id = 0;
  Utime utime = 0;      ///< of the first beam
  Utime utime_end = 0;  ///< of the last one
  std::vector<ScanPoint> points;
  std::int64_t beams = 0;  ///< those without a return too
  std::int64_t packets_missing = 0;
  std::string frame = "sensor";
};

/// Puts the packets of SCAN_DATA together again. A scan ends with its last packet, or when one of a
/// later scan comes.
class ScanAssembler {
 public:
  using Ready = std::function<void(const ScanCloud&)>;
  explicit ScanAssembler(Ready ready) : ready_(std::move(ready)) {}

  void take(const ScanPacket& packet);
  /// Hands out what is left.
  void finish();

 private:
  Ready ready_;
  ScanCloud scan_;
  bool open_ = false;
  std::int32_t next_packet_ = 0;
};

}  // namespace berth::logs
