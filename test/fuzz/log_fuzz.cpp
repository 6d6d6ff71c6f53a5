// SPDX-License-Identifier: BSD-3-Clause
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "app/runs/replay/player.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "logs/export/output_file.h"
#include "logs/file/log_reader.h"
#include "logs/file/timeline.h"
#include "logs/types/type_catalogue.h"
#include "logs/types/value.h"

using namespace berth;
using namespace berth::logs;

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

/// Every event is played once, in order, at the timeline's time.
void play(const std::string& path, Utime duration) {
  const LogIndex index(path);
  std::size_t played = 0;
  Player player(index, {}, [&](const LogEvent& event) {
    require(event.number == static_cast<std::int64_t>(played++));
  });
  player.start(0);
  for (auto due = player.next_due(); due; due = player.next_due()) {
    require(*due == elapsed(index.first(), index.time(played)) && *due <= duration);
    player.run(*due);
  }
  require(played == index.size());
}

/// Every byte of a file is in an event or reported as damage, in order; each event has a place on
/// the timeline, and its channel a name for a file.
void read_as_log(const std::uint8_t* data, std::size_t size) {
  static const std::string path = "/dev/shm/berth-log-fuzz-" + std::to_string(getpid());
  std::FILE* file = std::fopen(path.c_str(), "wb");
  require(file != nullptr && std::fwrite(data, 1, size, file) == size);
  std::fclose(file);
  LogReader reader(path);
  const Timeline timeline(reader);
  Timeline::Walker walker(timeline);
  LogEvent event;
  std::size_t events = 0;
  std::size_t end = 0;
  Utime position = 0;
  FileNames names;
  std::set<std::string> given;
  while (reader.next(event)) {
    const Utime place = walker.position(event.utime);
    require(place >= position && place <= timeline.duration());
    position = place;
    const std::string name = names.unique(event.channel, ".csv");
    require(name.size() < 256 && name.find('/') == std::string::npos && name[0] != '.');
    require(given.insert(name).second);
    require(event.offset >= end);
    end = event.offset + record_of(event).size();
    events += record_of(event).size();
  }
  require(end <= size && events + reader.damaged_bytes() == size);
  // As long as times can be added to each other, and their differences are exact as real numbers.
  constexpr Utime far = Utime{1} << 50;
  const bool usual = timeline.duration() < far && std::abs(timeline.start() / 2) < INT64_MAX / 4;
  if (usual) play(path, timeline.duration());
}

/// Whatever decodes can be written as JSON; damaged bytes give nothing.
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

/// Any text is valid in every format that it leaves in.
void write_as_text(const std::uint8_t* data, std::size_t size) {
  const std::string any(reinterpret_cast<const char*>(data), size);
  const std::string text = valid_utf8(any);
  require(valid_utf8(text) == text);
  const auto json = nlohmann::json::parse(json_text(nlohmann::json(any)));
  require(json_text(json) == json_text(nlohmann::json(json.get<std::string>())));
  require(markup_text(any).find_first_of("<>\"'\n\t") == std::string::npos);
  require(terminal_text(any).find('\x1b') == std::string::npos);
  require(terminal_line(any).find('\n') == std::string::npos);
  const std::string field = csv_field(any);
  if (field.empty() || field[0] != '"') {
    require(field.find_first_of(",\"\n\r") == std::string::npos);
  } else {
    std::size_t marks = 0;
    for (const char c : field) marks += c == '"';
    require(marks % 2 == 0 && field.back() == '"');
  }
}

/// First byte modulo 4: a log, a message, a .lcm file, a text.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 1 || size > 65536) return 0;
  void (*const parts[])(const std::uint8_t*, std::size_t) = {read_as_log, decode_as_message,
                                                             parse_as_type, write_as_text};
  parts[data[0] % 4](data + 1, size - 1);
  return 0;
}
