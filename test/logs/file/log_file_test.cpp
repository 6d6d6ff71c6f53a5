// SPDX-License-Identifier: BSD-3-Clause
#include <berth/heartbeat_t.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <lcm/lcm-cpp.hpp>

#include "common/core/error.h"
#include "logs/file/log_reader.h"
#include "logs/file/log_writer.h"
#include "test/catch.h"
#include "test/logs/file/made_log.h"

using namespace berth;
using namespace berth::logs;

namespace {

namespace fs = std::filesystem;

constexpr std::size_t payload = 40;
constexpr std::size_t event_bytes = format::header_bytes + 7 + payload;

/// Events of equal size on CHANNEL; the first bytes of each payload are its number.
void write_log(const fs::path& path, int events) {
  LogWriter writer(path);
  for (int i = 0; i < events; ++i) {
    std::vector<std::uint8_t> data(payload, 0x55);
    data[0] = static_cast<std::uint8_t>(i);
    writer.write(1000 + i, "CHANNEL", data);
  }
}

std::vector<int> numbers_in(LogReader& reader) {
  std::vector<int> numbers;
  LogEvent event;
  while (reader.next(event)) {
    CHECK(event.channel == "CHANNEL");
    CHECK(event.data.size() == payload);
    CHECK(event.utime == 1000 + event.number);
    numbers.push_back(event.data[0]);
  }
  return numbers;
}

std::vector<int> all_but(int events, std::initializer_list<int> lost) {
  std::vector<int> numbers;
  for (int i = 0; i < events; ++i) {
    if (std::find(lost.begin(), lost.end(), i) == lost.end()) numbers.push_back(i);
  }
  return numbers;
}

}  // namespace

TEST_CASE("what is written is read again") {
  TemporaryFile file;
  write_log(file.path, 100);
  LogReader reader(file.path);
  CHECK(numbers_in(reader) == all_but(100, {}));
  CHECK(reader.events() == 100);
  CHECK(reader.missing_events() == 0);
  CHECK(reader.damaged_bytes() == 0);
  reader.rewind();
  CHECK(numbers_in(reader).size() == 100);
}

TEST_CASE("LCM's own library reads our log, and we read its") {
  TemporaryFile file;
  write_log(file.path, 20);
  {
    lcm::LogFile stock(file.path.string(), "r");
    REQUIRE(stock.good());
    for (int i = 0; i < 20; ++i) {
      const lcm::LogEvent* event = stock.readNextEvent();
      REQUIRE(event != nullptr);
      CHECK(event->eventnum == i);
      CHECK(event->timestamp == 1000 + i);
      CHECK(event->channel == "CHANNEL");
      CHECK(event->datalen == static_cast<int>(payload));
    }
    CHECK(stock.readNextEvent() == nullptr);
  }
  TemporaryFile theirs;
  {
    lcm::LogFile stock(theirs.path.string(), "w");
    std::vector<std::uint8_t> data(payload, 3);
    lcm::LogEvent event{};
    event.timestamp = 1000;
    event.channel = "CHANNEL";
    event.datalen = static_cast<int>(payload);
    event.data = data.data();
    REQUIRE(stock.writeEvent(&event) == 0);
  }
  LogReader reader(theirs.path);
  CHECK(numbers_in(reader) == std::vector<int>{3});
}

TEST_CASE("whatever LCM's logger writes is read: any channel, any time, no data") {
  const std::vector<std::string> channels = {
      "WITH BLANK",         " ",          "caf\xC3\xA9", "\x01", "\x1b[31m",
      "tab\tand\nline",     "latin \xE9", "a/b",         "",     std::string(63, 'x'),
      std::string(999, 'y')};
  const std::vector<Utime> times = {0, -5, INT64_MIN, INT64_MAX, 1000};
  TemporaryFile file;
  {
    lcm::LogFile stock(file.path.string(), "w");
    for (const Utime time : times) {
      for (const std::string& channel : channels) {
        std::vector<std::uint8_t> data(channel.size() % 3, 0xED);
        lcm::LogEvent event{};
        event.timestamp = time;
        event.channel = channel;
        event.datalen = static_cast<int>(data.size());
        event.data = data.data();
        REQUIRE(stock.writeEvent(&event) == 0);
      }
    }
  }
  auto bytes = bytes_of(file.path);
  const auto once = bytes;
  bytes.insert(bytes.end(), once.begin(), once.end());  // joined: numbers begin anew
  overwrite(file.path, bytes);
  LogReader reader(file.path);
  LogEvent event;
  for (int n = 0; n < 2; ++n) {
    for (const Utime time : times) {
      for (const std::string& channel : channels) {
        REQUIRE(reader.next(event));
        CHECK(event.channel == channel);
        CHECK(event.utime == time);
        CHECK(event.data.size() == channel.size() % 3);
      }
    }
  }
  CHECK_FALSE(reader.next(event));
  CHECK(reader.damaged_bytes() == 0);
  CHECK(reader.missing_events() == 0);
}

TEST_CASE("a broken header loses its own event and no other") {
  TemporaryFile file;
  write_log(file.path, 50);
  auto bytes = bytes_of(file.path);
  SECTION("sync word") { std::fill_n(bytes.begin() + 20 * event_bytes, 4, 0); }
  SECTION("length of the channel") { bytes[20 * event_bytes + 20] = 0x7f; }
  SECTION("length of the data too great") { bytes[20 * event_bytes + 26] = 0x01; }
  SECTION("length of the data beyond the file") { bytes[20 * event_bytes + 25] = 0x7f; }
  SECTION("channel") { bytes[20 * event_bytes + 30] = 0; }
  overwrite(file.path, bytes);
  LogReader reader(file.path);
  const auto found = numbers_in(reader);
  CHECK(found == all_but(50, {20}));
  CHECK(reader.missing_events() == 1);
  REQUIRE(reader.damage().size() == 1);
  CHECK(reader.damage()[0].offset == 20 * event_bytes);
  CHECK(reader.damaged_bytes() == event_bytes);
}

TEST_CASE("a length that is too small hands out the beginning, and no other event is lost") {
  TemporaryFile file;
  write_log(file.path, 50);
  auto bytes = bytes_of(file.path);
  bytes[20 * event_bytes + 27] = 3;
  overwrite(file.path, bytes);
  LogReader reader(file.path);
  LogEvent event;
  int whole = 0;
  while (reader.next(event)) {
    if (event.number == 20) {
      CHECK(event.data.size() == 3);  // no message decodes from it
    } else {
      whole += event.data.size() == payload;
    }
  }
  CHECK(whole == 49);
  CHECK(reader.damaged_bytes() == payload - 3);
}

TEST_CASE("a tail that was cut off is damage, and all before it is good") {
  TemporaryFile file;
  write_log(file.path, 10);
  auto bytes = bytes_of(file.path);
  const std::size_t left = GENERATE(std::size_t{5}, format::header_bytes + 3, event_bytes - 1);
  bytes.resize(9 * event_bytes + left);
  overwrite(file.path, bytes);
  LogReader reader(file.path);
  CHECK(numbers_in(reader) == all_but(10, {9}));
  CHECK(reader.damaged_bytes() == left);
}

TEST_CASE("rubbish between events and a lost block are passed over") {
  TemporaryFile file;
  write_log(file.path, 60);
  auto bytes = bytes_of(file.path);
  const auto at = [&bytes](int event) {
    return bytes.begin() + static_cast<std::ptrdiff_t>(event * event_bytes);
  };
  bytes.erase(at(40), at(45));
  bytes.insert(at(10), 333, 0xED);  // begins like a sync word
  overwrite(file.path, bytes);
  LogReader reader(file.path);
  CHECK(numbers_in(reader) == all_but(60, {40, 41, 42, 43, 44}));
  CHECK(reader.missing_events() == 5);
  CHECK(reader.damaged_bytes() == 333);
}

TEST_CASE("empty files and files that are no log end at once") {
  TemporaryFile file;
  overwrite(file.path, {});
  LogReader empty(file.path);
  LogEvent event;
  CHECK_FALSE(empty.next(event));
  overwrite(file.path, std::vector<std::uint8_t>(10000, 'x'));
  LogReader text(file.path);
  CHECK_FALSE(text.next(event));
  CHECK(text.damaged_bytes() == 10000);
  CHECK_THROWS_AS(LogReader("/nonexistent.lcm"), InputError);
  CHECK_THROWS_AS(LogReader(fs::temp_directory_path()), InputError);
}

TEST_CASE("bytes that are not the requested message decode to nothing") {
  heartbeat_t heartbeat{};
  heartbeat.node = "a";
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(heartbeat.getEncodedSize()));
  heartbeat.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  CHECK(decode<heartbeat_t>(bytes)->node == "a");
  bytes[32] = 0xff;  // length of the string: negative
  CHECK_FALSE(decode<heartbeat_t>(bytes));
  bytes[0] ^= 1;
  CHECK_FALSE(decode<heartbeat_t>(bytes));
  CHECK_FALSE(decode<heartbeat_t>(Bytes{}));
}
