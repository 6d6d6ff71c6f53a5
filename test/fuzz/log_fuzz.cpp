// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "common/core/error.h"
#include "logs/file/log_reader.h"
#include "logs/types/type_catalogue.h"
#include "logs/types/value.h"

using namespace berth;
using namespace berth::logs;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

/// Every byte of a file is in an event or told as damage, in order.
void read_as_log(const std::uint8_t* data, std::size_t size) {
  static const std::string path = "/tmp/berth-log-fuzz-" + std::to_string(getpid());
  std::FILE* file = std::fopen(path.c_str(), "wb");
  require(file != nullptr && std::fwrite(data, 1, size, file) == size);
  std::fclose(file);
  LogReader reader(path);
  LogEvent event;
  std::size_t events = 0;
  std::size_t end = 0;
  while (reader.next(event)) {
    require(event.offset >= end);
    end = event.offset + record_of(event).size();
    events += record_of(event).size();
  }
  require(end <= size && events + reader.damaged_bytes() == size);
}

/// Whatever decodes can be told as JSON; damaged bytes give nothing.
void decode_as_message(const std::uint8_t* data, std::size_t size) {
  static const TypeCatalogue types = [] {
    TypeCatalogue t;
    t.add_text(
        "struct p { double x; byte b; } struct t { int16_t n; int32_t m; double f[2][3]; "
        "int16_t g[n][m]; p c[2][n]; string s[m]; boolean ok; t parts[n]; }",
        "fuzz.lcm");
    return t;
  }();
  static const StructType& type = *types.by_name("t");
  std::vector<std::uint8_t> bytes(8 + size);
  for (std::size_t i = 0; i < 8; ++i) {
    bytes[i] = static_cast<std::uint8_t>(type.fingerprint >> (56 - 8 * i));
  }
  std::copy(data, data + size, bytes.begin() + 8);
  const auto value = decode_value(type, bytes);
  require(value.has_value() == is_message(type, bytes));
  if (value) json_text(json_of(type, *value));
}

void parse_as_type(const std::uint8_t* data, std::size_t size) {
  try {
    TypeCatalogue().add_text({reinterpret_cast<const char*>(data), size}, "fuzz.lcm");
  } catch (const InputError&) {
  }
}

}  // namespace

/// First byte modulo 3: a log, a message, a .lcm file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1 || size > 65536) return 0;
  void (*const parts[])(const std::uint8_t*, std::size_t) = {read_as_log, decode_as_message,
                                                             parse_as_type};
  parts[data[0] % 3](data + 1, size - 1);
  return 0;
}
