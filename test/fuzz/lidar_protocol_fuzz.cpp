// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "drivers/lidar/protocol.h"

using namespace berth::lidar;

namespace {

/// Whatever is understood must be exactly what was sent.
void drain(Decoder& decoder, std::span<const std::uint8_t>& sent) {
  while (const auto message = decoder.next()) {
    const bool older = sent.size() > 5 && sent[5] == 0x83;  // Returns of version 1
    const auto again = encode(*message, older ? 1 : protocol_version);
    if (again.size() > sent.size() || !std::equal(again.begin(), again.end(), sent.begin())) {
      std::abort();
    }
    sent = sent.subspan(again.size());
  }
}

}  // namespace

/// First byte even: the rest is a stream, fed in pieces of its second byte. Odd: the rest is a
/// payload of the type in the second byte, in a sound frame.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2 || size > max_payload) return 0;
  std::span<const std::uint8_t> bytes(data + 2, size - 2);
  Decoder decoder;
  if (data[0] % 2 == 0) {
    const std::size_t piece = data[1] + std::size_t{1};
    std::span<const std::uint8_t> sent = bytes;
    for (std::size_t i = 0; i < bytes.size(); i += piece) {
      decoder.feed(bytes.subspan(i, std::min(piece, bytes.size() - i)));
      drain(decoder, sent);
    }
  } else {
    const auto frame = frame_of(data[1], bytes);
    std::span<const std::uint8_t> sent = frame;
    decoder.feed(frame);
    drain(decoder, sent);
  }
  return 0;
}
