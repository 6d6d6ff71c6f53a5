// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "common/core/beam_model.h"
#include "common/core/lidar_profile.h"

/// Berth's own protocol to a scanning LIDAR over TCP; PROTOCOL.md has every byte of it.
namespace berth::lidar {

inline constexpr std::uint16_t protocol_version = 2;  ///< the newest; 1 is spoken, too
inline constexpr std::size_t max_payload = 65536;
inline constexpr std::size_t max_windows = 500;
/// One datagram of SCAN_DATA with room for its header: Bus::max_message_bytes / 49 bytes a beam.
inline constexpr std::size_t max_beams_per_message = 1200;
inline constexpr std::size_t max_beams_version_1 = 3000;
/// Types of Returns on the wire.
inline constexpr std::uint8_t returns_type = 0x87;
inline constexpr std::uint8_t returns_of_version_1 = 0x83;

/// Host to device, first thing on a connection.
struct Hello {
  std::uint16_t version = protocol_version;  ///< the newest that the host speaks
};

/// Device's answer to Hello.
struct Identity {
  std::uint16_t version = protocol_version;  ///< of this connection: the newest of both
  std::string model;
  std::string serial;
  double rate_hz = 0;
  double range_min_m = 0;
  double range_max_m = 0;
  double field_of_view_rad[2] = {0, 0};  ///< full width and height
  double minimum_step_rad = 0;
};

/// Host to device.
struct ScanOrder {
  std::int64_t scan_id = 0;
  std::vector<Window> windows;
};

/// Device's answer to ScanOrder.
struct ScanAnswer {
  std::int64_t scan_id = 0;
  bool accepted = false;
  std::uint32_t beams = 0;  ///< that the scan will have
  std::string reason;       ///< of a refusal
};

/// A beam and its returns, as in scan_packet2_t. Of version 1: without origin, ambient light, sigma
/// and second return. 0: unknown.
struct BeamReturn {
  std::uint32_t after_us = 0;  ///< after Returns::device_time
  float range_m = 0;           ///< from the origin; 0 unless hit
  float azimuth_rad = 0;
  float elevation_rad = 0;
  std::uint16_t intensity = 0;  ///< 0..4095
  BeamStatus status = BeamStatus::miss;
  float origin_m[3] = {0, 0, 0};  ///< sensor frame
  float ambient = 0;              ///< on the scale of intensity
  float range_sigma_m = 0;
  float range2_m = 0;  ///< of another return; 0: there is none
  float range2_sigma_m = 0;
  std::uint16_t intensity2 = 0;
};

/// Device to host while a scan runs: consecutive beams of one window.
struct Returns {
  std::int64_t scan_id = 0;
  std::uint16_t window = 0;
  std::uint32_t beams_before = 0;  ///< beams of this scan sent before these
  std::int64_t device_time = 0;    ///< us on the device's clock, of the first beam
  std::vector<BeamReturn> beams;
};

enum class ScanResult : std::uint8_t { complete, cancelled, failed };

/// Device to host, after the last Returns of a scan.
struct ScanEnd {
  std::int64_t scan_id = 0;
  ScanResult result = ScanResult::complete;
  std::uint32_t beams = 0;  ///< sent in all
  std::int64_t device_time = 0;
  std::string reason;
};

/// Host to device; the scan then ends as cancelled.
struct Cancel {
  std::int64_t scan_id = 0;
};

/// Host to device, any time: requests state and clock.
struct StatusQuery {
  std::uint32_t token = 0;  ///< comes back
};

enum class DeviceState : std::uint8_t { idle, scanning, fault };

struct Status {
  std::uint32_t token = 0;
  std::int64_t device_time = 0;  ///< us on the device's clock when it answered
  DeviceState state = DeviceState::idle;
  std::int64_t scan_id = 0;  ///< current or last
  std::uint32_t beams_done = 0;
  std::string reason;  ///< of a fault
};

/// Device to host: why it is about to close the connection.
struct Complaint {
  std::string reason;
};

using Message = std::variant<Hello, Identity, ScanOrder, ScanAnswer, Returns, ScanEnd, Cancel,
                             StatusQuery, Status, Complaint>;

/// One frame. Texts longer than 255 bytes are cut. @throws std::length_error when the message does
/// not fit a frame, which is a bug of the caller.
/// @param version that both ends speak: of Returns, version 1 leaves out the fields that it has not
std::vector<std::uint8_t> encode(const Message& message, int version = protocol_version);

/// A payload as in a frame of this type, valid or not.
/// @throws std::length_error as encode.
std::vector<std::uint8_t> frame_of(std::uint8_t type, std::span<const std::uint8_t> payload);

/// Bytes in, messages out, of either version. Never throws for any input. The transport is
/// reliable, so damage means that the peer does not speak this protocol: the decoder then stops for
/// good with an error that names the fault, and the connection is to be closed.
class Decoder {
 public:
  void feed(std::span<const std::uint8_t> bytes);
  /// The next whole message; nothing when more bytes are needed or the stream is broken.
  std::optional<Message> next();
  bool broken() const { return !error_.empty(); }
  const std::string& error() const { return error_; }

 private:
  std::vector<std::uint8_t> buffer_;
  std::size_t taken_ = 0;  // of the buffer's front
  std::string error_;
};

}  // namespace berth::lidar
