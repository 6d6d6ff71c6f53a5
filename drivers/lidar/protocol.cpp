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
constexpr std::uint8_t frame_version = 1;  // of the frame, whatever it carries
constexpr std::size_t beam_size(int version) { return version == 1 ? 19 : 49; }
constexpr std::size_t max_beams(int version) {
  return version == 1 ? max_beams_version_1 : max_beams_per_message;
}
constexpr std::size_t max_text = 255;

static_assert(std::endian::native == std::endian::little, "numbers are copied as they stand");

/// Over version, type, reserved and length of the header (bytes 4 to 11), then the payload.
std::uint32_t frame_crc(std::span<const std::uint8_t> frame) {
  const auto add = [](uLong crc, std::span<const std::uint8_t> bytes) {
    return crc32_z(crc, bytes.data(), bytes.size());
  };
  return static_cast<std::uint32_t>(add(add(0, frame.subspan(4, 8)), frame.subspan(header_size)));
}

/// The last value of each enumeration on the wire.
template <class Enum>
constexpr Enum last_value = Enum{};
template <>
constexpr Pattern last_value<Pattern> = Pattern::lissajous;
template <>
constexpr BeamStatus last_value<BeamStatus> = BeamStatus::saturated;
template <>
constexpr ScanResult last_value<ScanResult> = ScanResult::failed;
template <>
constexpr DeviceState last_value<DeviceState> = DeviceState::fault;

/// Whether a value that was read is valid.
template <class Value>
bool is_sound(Value value) {
  if constexpr (std::is_floating_point_v<Value>) return std::isfinite(value);
  if constexpr (std::is_enum_v<Value>) {
    return static_cast<std::uint8_t>(value) <= static_cast<std::uint8_t>(last_value<Value>);
  }
  return true;
}

/// A beam's fields in their order on the wire.
template <class Beam, class Visit>
void visit_fields(Beam& beam, int version, Visit visit) {
  visit(beam.after_us);
  visit(beam.range_m);
  visit(beam.azimuth_rad);
  visit(beam.elevation_rad);
  visit(beam.intensity);
  visit(beam.status);
  if (version == 1) return;
  for (auto& value : beam.origin_m) visit(value);
  visit(beam.ambient);
  visit(beam.range_sigma_m);
  visit(beam.range2_m);
  visit(beam.range2_sigma_m);
  visit(beam.intensity2);
}

class Writer {
 public:
  explicit Writer(int version = protocol_version) : version_(version) {}

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
  /// All beams in one go: there are thousands in a message.
  void put(const std::vector<BeamReturn>& beams) {
    const std::size_t at = bytes.size();
    bytes.resize(at + beams.size() * beam_size(version_));
    std::uint8_t* to = bytes.data() + at;
    for (const BeamReturn& beam : beams) {
      visit_fields(beam, version_, [&to](auto value) {
        std::memcpy(to, &value, sizeof value);
        to += sizeof value;
      });
    }
  }

  std::vector<std::uint8_t> bytes;

 private:
  int version_;
};

/// Reads the output of Writer. An invalid value is left unset, and ok() is false from then on.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes, int version = protocol_version)
      : bytes_(bytes), version_(version) {}

  template <class Value>
  Value take() {
    Value value{};
    take(value);
    return value;
  }
  template <class Value>
  void take(Value& value) {
    Value read{};
    if (bytes_.size() < sizeof read) return fail();
    std::memcpy(&read, bytes_.data(), sizeof read);
    bytes_ = bytes_.subspan(sizeof read);
    if (!is_sound(read)) return fail();
    value = read;
  }
  void take(std::string& text) {
    const std::size_t size = take<std::uint8_t>();
    if (bytes_.size() < size) return fail();
    text.assign(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size));
    bytes_ = bytes_.subspan(size);
  }
  /// So many beams, after which nothing follows.
  void take(std::vector<BeamReturn>& beams, std::size_t count) {
    if (count > max_beams(version_) || left() != count * beam_size(version_)) return fail();
    beams.resize(count);
    const std::uint8_t* from = bytes_.data();
    bool sound = true;
    for (BeamReturn& beam : beams) {
      visit_fields(beam, version_, [&](auto& value) {
        std::memcpy(&value, from, sizeof value);
        from += sizeof value;
        sound = sound && is_sound(value);
      });
    }
    bytes_ = {};
    if (!sound) fail();
  }
  void fail() { ok_ = false; }

  std::size_t left() const { return bytes_.size(); }
  bool ok() const { return ok_; }

 private:
  std::span<const std::uint8_t> bytes_;
  int version_;
  bool ok_ = true;
};

/// The type byte of each message, in the order of Message.
constexpr std::array<std::uint8_t, std::variant_size_v<Message>> types = {
    0x01, 0x81, 0x02, 0x82, returns_type, 0x84, 0x03, 0x04, 0x85, 0x86};

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
    w.put(window.pattern);
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
    r.take(window.pattern);
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
  w.put(m.beams);
}
void read(Reader& r, Returns& m) {
  r.take(m.scan_id);
  r.take(m.window);
  r.take(m.beams_before);
  r.take(m.device_time);
  const std::size_t count = r.take<std::uint16_t>();
  r.take(m.beams, count);
}

void write(Writer& w, const ScanEnd& m) {
  w.put(m.scan_id);
  w.put(m.result);
  w.put(m.beams);
  w.put(m.device_time);
  w.put(m.reason);
}
void read(Reader& r, ScanEnd& m) {
  r.take(m.scan_id);
  r.take(m.result);
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
  w.put(m.state);
  w.put(m.scan_id);
  w.put(m.beams_done);
  w.put(m.reason);
}
void read(Reader& r, Status& m) {
  r.take(m.token);
  r.take(m.device_time);
  r.take(m.state);
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
  writer.put(frame_version);
  writer.put(type);
  writer.put(std::uint16_t{0});
  writer.put(static_cast<std::uint32_t>(payload.size()));
  writer.put(std::uint32_t{0});  // the CRC, once all is there
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  const std::uint32_t crc = frame_crc(bytes);
  for (std::size_t i = 0; i < 4; ++i) bytes[12 + i] = static_cast<std::uint8_t>(crc >> 8 * i);
  return std::move(bytes);
}

std::vector<std::uint8_t> encode(const Message& message, int version) {
  Writer writer(version);
  std::visit([&](const auto& m) { write(writer, m); }, message);
  if (version == 1 && std::holds_alternative<Returns>(message)) {
    return frame_of(returns_of_version_1, writer.bytes);
  }
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
  if (version != frame_version) {
    error_ = "a frame of version " + std::to_string(version) + ", expected " +
             std::to_string(frame_version);
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
  const bool older = type == returns_of_version_1;
  Reader payload(frame.subspan(header_size), older ? 1 : protocol_version);
  Message message;
  if (!read_payload(older ? returns_type : type, payload, message)) {
    error_ = "a message of unknown type " + std::to_string(type);
  } else if (!payload.ok() || payload.left() != 0) {
    error_ = "a message of type " + std::to_string(type) + " is malformed";
  }
  if (broken()) return std::nullopt;
  taken_ += frame.size();
  return message;
}

}  // namespace berth::lidar
