// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/protocol.h"

#include "common/core/random.h"
#include "test/catch.h"

using namespace berth;
using namespace berth::lidar;

namespace {

std::vector<Message> samples() {
  Identity identity;
  identity.model = "ILRIS-3D";
  identity.serial = "0042";
  identity.rate_hz = 2000;
  identity.field_of_view_rad[1] = 0.7;
  ScanOrder order{17, {{0.1, -0.2, 0.3, 0.4, Pattern::rosette, 100, 0, ""}, {}}};
  Returns returns;
  returns.scan_id = 17;
  returns.window = 1;
  returns.beams_before = 150;
  returns.device_time = -5;
  returns.beams = {{0, 5.25F, 0.1F, -0.2F, 4095, BeamStatus::hit},
                   {500, 0, 0.1F, -0.2F, 0, BeamStatus::miss}};
  BeamReturn& first = returns.beams[0];
  first.origin_m[0] = 0.015F;
  first.origin_m[2] = -0.03F;
  first.ambient = 5000.5F;
  first.range_sigma_m = 0.01F;
  first.range2_m = 7.5F;
  first.range2_sigma_m = 0.02F;
  first.intensity2 = 17;
  return {Hello{},
          identity,
          order,
          ScanAnswer{17, false, 0, "too much"},
          returns,
          ScanEnd{17, ScanResult::failed, 2, 123456789012345, "dust"},
          Cancel{-3},
          StatusQuery{0xffffffff},
          Status{7, 1LL << 60, DeviceState::fault, 17, 2, "hot"},
          Complaint{"what?"}};
}

std::vector<std::uint8_t> stream_of(const std::vector<Message>& messages) {
  std::vector<std::uint8_t> bytes;
  for (const Message& message : messages) {
    const auto frame = encode(message);
    bytes.insert(bytes.end(), frame.begin(), frame.end());
  }
  return bytes;
}

std::vector<Message> decode_all(Decoder& decoder) {
  std::vector<Message> messages;
  while (auto message = decoder.next()) messages.push_back(std::move(*message));
  return messages;
}

}  // namespace

TEST_CASE("every message survives the wire, whatever the pieces it comes in") {
  const auto messages = samples();
  const auto bytes = stream_of(messages);
  for (const std::size_t piece : {std::size_t{1}, std::size_t{3}, std::size_t{16}, bytes.size()}) {
    Decoder decoder;
    std::vector<Message> received;
    for (std::size_t i = 0; i < bytes.size(); i += piece) {
      decoder.feed(std::span(bytes).subspan(i, std::min(piece, bytes.size() - i)));
      for (auto& message : decode_all(decoder)) received.push_back(std::move(message));
    }
    INFO(decoder.error());
    REQUIRE(received.size() == messages.size());
    // Equal encodings are equal messages.
    for (std::size_t i = 0; i < messages.size(); ++i) {
      CHECK(received[i].index() == messages[i].index());
      CHECK(encode(received[i]) == encode(messages[i]));
    }
  }
}

TEST_CASE("the bytes are the documented ones") {
  const auto bytes = encode(StatusQuery{0x01020304});
  const std::vector<std::uint8_t> head = {'B', 'L', 'D', 'R', 1, 0x04, 0, 0, 4, 0, 0, 0};
  REQUIRE(bytes.size() == 20);
  CHECK(std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + 12) == head);
  CHECK(std::vector<std::uint8_t>(bytes.begin() + 16, bytes.end()) ==
        std::vector<std::uint8_t>{4, 3, 2, 1});
  // CRC-32 of 01 04 00 00 04 00 00 00 04 03 02 01 by the bit-wise definition.
  std::uint32_t crc = 0xffffffff;
  for (const int byte : {1, 4, 0, 0, 4, 0, 0, 0, 4, 3, 2, 1}) {
    crc ^= static_cast<std::uint32_t>(byte);
    for (int k = 0; k < 8; ++k) crc = (crc & 1U) != 0 ? (crc >> 1) ^ 0xedb88320U : crc >> 1;
  }
  crc = ~crc;
  for (std::size_t i = 0; i < 4; ++i) CHECK(bytes[12 + i] == ((crc >> (8 * i)) & 0xff));
}

TEST_CASE("version 1 has the fields of a beam that it can hold, and is understood") {
  const auto sent = samples();
  const auto bytes = encode(sent[4], 1);
  CHECK(bytes[5] == 0x83);
  CHECK(bytes.size() == 16 + 24 + 2 * 19);
  CHECK(encode(sent[4])[5] == 0x87);
  CHECK(encode(sent[4]).size() == 16 + 24 + 2 * 49);
  Decoder decoder;
  decoder.feed(bytes);
  const auto message = decoder.next();
  REQUIRE(message);
  const BeamReturn& beam = std::get<Returns>(*message).beams[0];
  CHECK(beam.range_m == 5.25F);
  CHECK(beam.intensity == 4095);
  CHECK(beam.status == BeamStatus::hit);
  CHECK(beam.origin_m[0] == 0);
  CHECK(beam.range_sigma_m == 0);
  CHECK(beam.range2_m == 0);
  CHECK(encode(*message, 1) == bytes);
  for (const Message& other : sent) {
    if (!std::holds_alternative<Returns>(other)) CHECK(encode(other, 1) == encode(other));
  }
}

TEST_CASE("a frame has as many beams as a datagram of the bus, of version 1 as many as it allows") {
  for (const int version : {1, 2}) {
    const std::size_t max_count = version == 1 ? max_beams_version_1 : max_beams_per_message;
    for (const std::size_t count : {max_count, max_count + 1}) {
      Returns returns;
      returns.beams.resize(count);
      Decoder decoder;
      decoder.feed(encode(returns, version));
      CHECK(decoder.next().has_value() == (count == max_count));
    }
  }
}

TEST_CASE("texts too long are cut, messages too long are a bug of the caller") {
  Decoder decoder;
  decoder.feed(encode(Complaint{std::string(1000, 'x')}));
  const auto message = decoder.next();
  REQUIRE(message);
  CHECK(std::get<Complaint>(*message).reason.size() == 255);
  Returns returns;
  returns.beams.resize(10000);
  CHECK_THROWS_AS(encode(returns), std::length_error);
}

TEST_CASE("each kind of damage stops the decoder with a reason") {
  const auto error_of = [](std::vector<std::uint8_t> bytes) {
    Decoder decoder;
    decoder.feed(bytes);
    CHECK_FALSE(decoder.next());
    CHECK(decoder.broken());
    decoder.feed(encode(Hello{}));  // and it stays stopped
    CHECK_FALSE(decoder.next());
    return decoder.error();
  };
  using Catch::Matchers::Contains;
  const auto good = encode(Cancel{5});
  const auto with = [&](std::size_t at, std::uint8_t value) {
    auto bytes = good;
    bytes[at] = value;
    return bytes;
  };
  CHECK_THAT(error_of({'H', 'T', 'T', 'P'}), Contains("BLDR"));
  CHECK_THAT(error_of({'X'}), Contains("BLDR"));
  CHECK_THAT(error_of(with(4, 2)), Contains("version 2"));
  CHECK_THAT(error_of(with(6, 1)), Contains("reserved"));
  CHECK_THAT(error_of(with(11, 0x7f)), Contains("at most 65536"));
  CHECK_THAT(error_of(with(5, 0x99)), Contains("check sum"));
  CHECK_THAT(error_of(with(20, 0xff)), Contains("check sum"));
}

TEST_CASE("a frame that is whole but wrong inside is refused") {
  // Made by encoding values that the reader must not accept.
  const auto error_of = [](const Message& message) {
    Decoder decoder;
    decoder.feed(encode(message));
    CHECK_FALSE(decoder.next());
    return decoder.error();
  };
  using Catch::Matchers::Contains;
  Returns returns;
  returns.beams.resize(1);
  returns.beams[0].range_m = std::numeric_limits<float>::infinity();
  CHECK_THAT(error_of(returns), Contains("malformed"));
  returns.beams[0].range_m = 1;
  returns.beams[0].origin_m[1] = std::numeric_limits<float>::quiet_NaN();
  CHECK_THAT(error_of(returns), Contains("malformed"));
  returns.beams[0].origin_m[1] = 0;
  returns.beams[0].status = static_cast<BeamStatus>(9);
  CHECK_THAT(error_of(returns), Contains("malformed"));
  ScanOrder order{1, std::vector<Window>(max_windows + 1)};
  CHECK_THAT(error_of(order), Contains("malformed"));
  order.windows.resize(1);
  order.windows[0].pattern = static_cast<Pattern>(4);
  CHECK_THAT(error_of(order), Contains("malformed"));
}

TEST_CASE("damaged streams never give a message that was not sent") {
  const auto messages = samples();
  std::vector<std::vector<std::uint8_t>> sent;
  for (const Message& message : messages) sent.push_back(encode(message));
  const auto clean = stream_of(messages);
  Random random(11, "damage");
  int broken = 0;
  for (int round = 0; round < 20000; ++round) {
    auto bytes = clean;
    const int flips = 1 + static_cast<int>(random.uniform() * 3);
    for (int k = 0; k < flips; ++k) {
      bytes[static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size()))] ^=
          static_cast<std::uint8_t>(1U << static_cast<unsigned>(random.uniform() * 8));
    }
    if (random.uniform() < 0.3) {
      bytes.resize(static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size())));
    }
    Decoder decoder;
    decoder.feed(bytes);
    std::size_t i = 0;
    for (const Message& message : decode_all(decoder)) {
      if (i >= sent.size() || encode(message) != sent[i]) FAIL("a message out of nothing");
      ++i;
    }
    if (decoder.broken()) ++broken;
  }
  CHECK(broken > 15000);
}

TEST_CASE("noise in a sound frame is refused, or is a message") {
  Random random(12, "noise");
  const auto examples = samples();
  int understood = 0;
  for (int round = 0; round < 20000; ++round) {
    auto frame = encode(examples[static_cast<std::size_t>(round) % examples.size()]);
    const std::uint8_t type = frame[5];
    std::vector<std::uint8_t> payload(frame.begin() + 16, frame.end());
    for (auto& byte : payload) {
      if (random.uniform() < 0.1) byte = static_cast<std::uint8_t>(random.bits());
    }
    if (random.uniform() < 0.2) {
      payload.resize(static_cast<std::size_t>(random.uniform() * 100));
    }
    frame = frame_of(type, payload);
    Decoder decoder;
    decoder.feed(frame);
    const auto message = decoder.next();
    REQUIRE(message.has_value() != decoder.broken());
    if (!message) continue;
    CHECK(encode(*message) == frame);  // nothing was read into it
    ++understood;
  }
  CHECK(understood > 2000);
  CHECK(understood < 18000);
}
