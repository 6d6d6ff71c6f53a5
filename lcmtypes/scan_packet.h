// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/scan_packet2_t.hpp>
#include <berth/scan_packet_t.hpp>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "common/core/beam_model.h"

namespace berth {

/// SCAN_DATA as read from the bus and from logs: a scan_packet2_t, or the older scan_packet_t of
/// recorded runs and of other drivers, whose beams leave the sensor's origin and have no sigma,
/// ambient light and second returns. The fingerprint at the begin of the bytes distinguishes the
/// types. All arrays have `count` entries.
struct ScanPacket : scan_packet2_t {
  /// As of generated types: the number of bytes read, negative when these are no packet.
  int decode(const void* bytes, int offset, int size) {
    int read = scan_packet2_t::decode(bytes, offset, size);
    if (read < 0) {
      scan_packet_t older{};
      read = older.decode(bytes, offset, size);
      if (read >= 0) take(std::move(older));
    }
    if (read >= 0) resize(static_cast<std::size_t>(count));
    return read;
  }

  /// Beams that are new are zero in everything.
  void resize(std::size_t beams) {
    count = static_cast<std::int32_t>(beams);
    time_us.resize(beams);
    status.resize(beams);
    for (auto* of_beams : {&origin_x_m, &origin_y_m, &origin_z_m, &azimuth_rad, &elevation_rad,
                           &ambient, &range_m, &range_sigma_m, &range2_m, &range2_sigma_m}) {
      of_beams->resize(beams);
    }
    intensity.resize(beams);
    intensity2.resize(beams);
  }

  /// Where beam i begins. [m], sensor frame
  Vector3d origin(std::size_t i) const {
    return {static_cast<double>(origin_x_m[i]), static_cast<double>(origin_y_m[i]),
            static_cast<double>(origin_z_m[i])};
  }
  /// Unit, sensor frame.
  Vector3d direction(std::size_t i) const {
    return beam_direction(static_cast<double>(azimuth_rad[i]),
                          static_cast<double>(elevation_rad[i]));
  }
  /// An invalid status counts as saturated: a beam without information.
  BeamStatus beam_status(std::size_t i) const {
    return status[i] >= HIT && status[i] <= SATURATED ? static_cast<BeamStatus>(status[i])
                                                      : BeamStatus::saturated;
  }
  /// Where a range along beam i ends. [m], sensor frame
  Vector3d point(std::size_t i, float range) const {
    return origin(i) + static_cast<double>(range) * direction(i);
  }
  /// The first return of a beam as if the beam left the sensor's origin: that of its point. A beam
  /// without a range keeps its angles.
  struct Seen {
    double range;  ///< m
    double azimuth;
    double elevation;
  };
  Seen seen_from_sensor(std::size_t i) const {
    Seen seen{static_cast<double>(range_m[i]), static_cast<double>(azimuth_rad[i]),
              static_cast<double>(elevation_rad[i])};
    if (seen.range == 0 || origin(i) == Vector3d::Zero()) return seen;
    const Vector3d point = this->point(i, range_m[i]);
    seen.range = point.norm();
    beam_angles(point, seen.azimuth, seen.elevation);
    return seen;
  }

 private:
  void take(scan_packet_t older) {
    static_cast<scan_packet2_t&>(*this) = {};
    utime = older.utime;
    seq = older.seq;
    session = older.session;
    scan_id = older.scan_id;
    packet = older.packet;
    scan_status = older.scan_status;
    reason = std::move(older.reason);
    window = older.window;
    beams_before = older.beams_before;
    count = older.count;
    time_us = std::move(older.time_us);
    azimuth_rad = std::move(older.azimuth_rad);
    elevation_rad = std::move(older.elevation_rad);
    status = std::move(older.status);
    range_m = std::move(older.range_m);
    intensity = std::move(older.intensity);
  }
};

}  // namespace berth
