// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/protocol.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <stdexcept>

namespace berth::lidar {
namespace {

constexpr std::array<std::uint8_t, 4> magic = {'B', 'L', 'D', 'R'};
constexpr std::size_t header_size = 16;
constexpr std::size_t beam_size = 19;
constexpr std::size_t max_text = 255;

static_assert(std::endian::native == std::endian::little, "numbers are copied as they stand");

/// Over version, type, reserved and length of the header (bytes 4 to 11), then the payload.
std::uint32_t frame_crc(std::span<const std::uint8_t> frame) {
  const auto add = [](uLong crc, std::span<const std::uint8_t> bytes) {
    return crc32_z(crc, bytes.data(), bytes.size());
  };
  return static_cast<std::uint32_t>(add(add(0, frame.subspan(4, 8)), frame.subspan(header_size)));
}

class Writer {
 public:
  template <class Value>
  void put(Value value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof value);
    std::memcpy(bytes.data() + at, &value, sizeof value);
  }
  void put(const std::string& text) {
    const std::size_t size = std::min(text.size(), max_text);
    put(static_cast<std::uint8_t>(size));
    bytes.insert(bytes.end(), text.begin(), text.begin() + static_cast<std::ptrdiff_t>(size));
  }
  /// So many more bytes, to be filled by the caller before anything else is put.
  std::uint8_t* grow(std::size_t size) {
    bytes.resize(bytes.size() + size);
    return bytes.data() + bytes.size() - size;
  }

  std::vector<std::uint8_t> bytes;
};

/// Reads what Writer wrote. After a failure all further values are 0 and ok() is false.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <class Value>
  Value take() {
    if (bytes_.size() < sizeof(Value)) {
      ok_ = false;
      return 0;
    }
    Value value;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    if constexpr (std::is_floating_point_v<Value>) {
      if (!std::isfinite(value)) {
        ok_ = false;
        return 0;
      }
    }
    return value;
  }
  template <class Value>
  void take(Value& value) {
    value = take<Value>();
  }
  void take(std::string& text) {
    const std::size_t size = take<std::uint8_t>();
    if (bytes_.size() < size) {
      ok_ = false;
      return;
    }
    text.assign(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size));
    bytes_ = bytes_.subspan(size);
  }
  /// A byte that names one of the values up to last.
  template <class Enum>
  void take_enum(Enum& value, Enum last) {
    const auto byte = take<std::uint8_t>();
    if (byte > static_cast<std::uint8_t>(last)) {
      ok_ = false;
      return;
    }
    value = static_cast<Enum>(byte);
  }
  void fail() { ok_ = false; }
  /// So many bytes, which the caller knows to be left.
  const std::uint8_t* skip(std::size_t size) {
    const std::uint8_t* at = bytes_.data();
    bytes_ = bytes_.subspan(size);
    return at;
  }

  std::size_t left() const { return bytes_.size(); }
  bool ok() const { return ok_; }

 private:
  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

/// The type byte of each message, in the order of Message.
constexpr std::array<std::uint8_t, std::variant_size_v<Message>> types = {
    0x01, 0x81, 0x02, 0x82, 0x83, 0x84, 0x03, 0x04, 0x85, 0x86};

void write(Writer& w, const Hello& m) { w.put(m.version); }
void read(Reader& r, Hello& m) { r.take(m.version); }

void write(Writer& w, const Identity& m) {
  w.put(m.version);
  w.put(m.model);
  w.put(m.serial);
  for (const double value : {m.rate_hz, m.range_min_m, m.range_max_m, m.field_of_view_rad[0],
                             m.field_of_view_rad[1], m.minimum_step_rad}) {
    w.put(value);
  }
}
void read(Reader& r, Identity& m) {
  r.take(m.version);
  r.take(m.model);
  r.take(m.serial);
  for (double* value : {&m.rate_hz, &m.range_min_m, &m.range_max_m, &m.field_of_view_rad[0],
                        &m.field_of_view_rad[1], &m.minimum_step_rad}) {
    r.take(*value);
  }
}

void write(Writer& w, const ScanOrder& m) {
  w.put(m.scan_id);
  w.put(static_cast<std::uint16_t>(m.windows.size()));
  for (const Window& window : m.windows) {
    w.put(window.azimuth);
    w.put(window.elevation);
    w.put(window.width);
    w.put(window.height);
    w.put(static_cast<std::uint8_t>(window.pattern));
    w.put(window.count);
    w.put(window.spacing);
  }
}
void read(Reader& r, ScanOrder& m) {
  constexpr std::size_t window_size = 45;
  r.take(m.scan_id);
  const std::size_t count = r.take<std::uint16_t>();
  if (count > max_windows || r.left() != count * window_size) return r.fail();
  m.windows.resize(count);
  for (Window& window : m.windows) {
    r.take(window.azimuth);
    r.take(window.elevation);
    r.take(window.width);
    r.take(window.height);
    r.take_enum(window.pattern, Pattern::lissajous);
    r.take(window.count);
    r.take(window.spacing);
  }
}

void write(Writer& w, const ScanAnswer& m) {
  w.put(m.scan_id);
  w.put(static_cast<std::uint8_t>(m.accepted ? 1 : 0));
  w.put(m.beams);
  w.put(m.reason);
}
void read(Reader& r, ScanAnswer& m) {
  r.take(m.scan_id);
  const auto accepted = r.take<std::uint8_t>();
  if (accepted > 1) return r.fail();
  m.accepted = accepted == 1;
  r.take(m.beams);
  r.take(m.reason);
}

void write(Writer& w, const Returns& m) {
  w.put(m.scan_id);
  w.put(m.window);
  w.put(m.beams_before);
  w.put(m.device_time);
  w.put(static_cast<std::uint16_t>(m.beams.size()));
  std::uint8_t* at = w.grow(m.beams.size() * beam_size);
  const auto put = [&at](auto value) {
    std::memcpy(at, &value, sizeof value);
    at += sizeof value;
  };
  for (const BeamReturn& beam : m.beams) {
    put(beam.after_us);
    put(beam.range_m);
    put(beam.azimuth_rad);
    put(beam.elevation_rad);
    put(beam.intensity);
    put(static_cast<std::uint8_t>(beam.status));
  }
}
void read(Reader& r, Returns& m) {
  r.take(m.scan_id);
  r.take(m.window);
  r.take(m.beams_before);
  r.take(m.device_time);
  const std::size_t count = r.take<std::uint16_t>();
  if (count > max_beams_per_message || r.left() != count * beam_size) return r.fail();
  m.beams.resize(count);
  const std::uint8_t* at = r.skip(count * beam_size);
  const auto take = [&at](auto& value) {
    std::memcpy(&value, at, sizeof value);
    at += sizeof value;
  };
  bool good = true;
  for (BeamReturn& beam : m.beams) {
    take(beam.after_us);
    take(beam.range_m);
    take(beam.azimuth_rad);
    take(beam.elevation_rad);
    take(beam.intensity);
    const std::uint8_t status = *at++;
    good = good && status <= static_cast<std::uint8_t>(BeamStatus::saturated) &&
           std::isfinite(beam.range_m) && std::isfinite(beam.azimuth_rad) &&
           std::isfinite(beam.elevation_rad);
    beam.status = good ? static_cast<BeamStatus>(status) : BeamStatus{};
  }
  if (!good) r.fail();
}

void write(Writer& w, const ScanEnd& m) {
  w.put(m.scan_id);
  w.put(static_cast<std::uint8_t>(m.result));
  w.put(m.beams);
  w.put(m.device_time);
  w.put(m.reason);
}
void read(Reader& r, ScanEnd& m) {
  r.take(m.scan_id);
  r.take_enum(m.result, ScanResult::failed);
  r.take(m.beams);
  r.take(m.device_time);
  r.take(m.reason);
}

void write(Writer& w, const Cancel& m) { w.put(m.scan_id); }
void read(Reader& r, Cancel& m) { r.take(m.scan_id); }

void write(Writer& w, const StatusQuery& m) { w.put(m.token); }
void read(Reader& r, StatusQuery& m) { r.take(m.token); }

void write(Writer& w, const Status& m) {
  w.put(m.token);
  w.put(m.device_time);
  w.put(static_cast<std::uint8_t>(m.state));
  w.put(m.scan_id);
  w.put(m.beams_done);
  w.put(m.reason);
}
void read(Reader& r, Status& m) {
  r.take(m.token);
  r.take(m.device_time);
  r.take_enum(m.state, DeviceState::fault);
  r.take(m.scan_id);
  r.take(m.beams_done);
  r.take(m.reason);
}

void write(Writer& w, const Complaint& m) { w.put(m.reason); }
void read(Reader& r, Complaint& m) { r.take(m.reason); }

/// Tries each message type in turn. @return false when no type has this byte.
template <std::size_t Index = 0>
bool read_payload(std::uint8_t type, Reader& reader, Message& message) {
  if constexpr (Index == std::variant_size_v<Message>) {
    return false;
  } else {
    if (type != types[Index]) return read_payload<Index + 1>(type, reader, message);
    read(reader, message.emplace<Index>());
    return true;
  }
}

}  // namespace

std::vector<std::uint8_t> frame_of(std::uint8_t type, std::span<const std::uint8_t> payload) {
  if (payload.size() > max_payload) throw std::length_error("a LIDAR message does not fit a frame");
  Writer writer;
  std::vector<std::uint8_t>& bytes = writer.bytes;
  bytes.reserve(header_size + payload.size());
  bytes.assign(magic.begin(), magic.end());
  writer.put(static_cast<std::uint8_t>(protocol_version));
  writer.put(type);
  writer.put(std::uint16_t{0});
  writer.put(static_cast<std::uint32_t>(payload.size()));
  writer.put(std::uint32_t{0});  // the CRC, once all is there
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  const std::uint32_t crc = frame_crc(bytes);
  for (std::size_t i = 0; i < 4; ++i) bytes[12 + i] = static_cast<std::uint8_t>(crc >> 8 * i);
  return std::move(bytes);
}

std::vector<std::uint8_t> encode(const Message& message) {
  Writer writer;
  std::visit([&](const auto& m) { write(writer, m); }, message);
  return frame_of(types[message.index()], writer.bytes);
}

void Decoder::feed(std::span<const std::uint8_t> bytes) {
  if (broken()) return;
  if (taken_ > 0) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(taken_));
    taken_ = 0;
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::optional<Message> Decoder::next() {
  if (broken()) return std::nullopt;
  const std::span<const std::uint8_t> bytes = std::span(buffer_).subspan(taken_);
  const std::size_t known = std::min(bytes.size(), magic.size());
  if (!std::equal(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(known),
                  magic.begin())) {
    error_ = "not a frame: it does not begin with BLDR";
    return std::nullopt;
  }
  if (bytes.size() < header_size) return std::nullopt;

  Reader header(bytes.subspan(magic.size(), header_size - magic.size()));
  const auto version = header.take<std::uint8_t>();
  const auto type = header.take<std::uint8_t>();
  const auto reserved = header.take<std::uint16_t>();
  const auto length = header.take<std::uint32_t>();
  const auto crc = header.take<std::uint32_t>();
  if (version != protocol_version) {
    error_ = "a frame of version " + std::to_string(version) + ", expected " +
             std::to_string(protocol_version);
  } else if (reserved != 0) {
    error_ = "reserved bytes of a frame are not 0";
  } else if (length > max_payload) {
    error_ = "a frame of " + std::to_string(length) + " bytes, at most " +
             std::to_string(max_payload) + " are possible";
  }
  if (broken()) return std::nullopt;
  if (bytes.size() < header_size + length) return std::nullopt;

  const auto frame = bytes.first(header_size + length);
  if (frame_crc(frame) != crc) {
    error_ = "a frame fails its check sum";
    return std::nullopt;
  }
  Reader payload(frame.subspan(header_size));
  Message message;
  if (!read_payload(type, payload, message)) {
    error_ = "a message of unknown type " + std::to_string(type);
  } else if (!payload.ok() || payload.left() != 0) {
    error_ = "a message of type " + std::to_string(type) + " is malformed";
  }
  if (broken()) return std::nullopt;
  taken_ += frame.size();
  return message;
}

}  // namespace berth::lidar
