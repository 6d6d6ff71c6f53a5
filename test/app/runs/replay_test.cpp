// SPDX-License-Identifier: BSD-3-Clause
// Playing a log: index, player, channels and pairs of estimates, without a clock or a bus.
#include <berth/heartbeat_t.hpp>
#include <fstream>

#include "app/runs/replay/live_estimator.h"
#include "app/runs/replay/player.h"
#include "app/runs/replay/replay_bus.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "logs/file/log_writer.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;

namespace {

namespace fs = std::filesystem;

struct Message {
  Utime utime;
  std::string channel;
};

/// A log of these messages, each with its number as its data, and its index.
struct MadeLog {
  explicit MadeLog(const std::vector<Message>& messages) : path(folder / "made.lcm") {
    logs::LogWriter log(path);
    std::uint8_t number = 0;
    for (const auto& [utime, channel] : messages) log.write(utime, channel, {&++number, 1});
  }

  TemporaryDirectory folder;
  fs::path path;
};

/// Messages of two channels, at 0, 10, 20 ... ms, and one after a silence of 10 s.
MadeLog usual_log() {
  std::vector<Message> messages;
  for (int i = 0; i < 100; ++i) {
    messages.push_back({made::start + i * 10 * millisecond, i % 10 == 5 ? "POSE_ESTIMATE" : "A"});
  }
  messages.push_back({made::start + 11 * second, "TAIL"});
  return MadeLog(messages);
}

struct Played {
  MadeLog log = usual_log();
  LogIndex index{log.path};
  std::vector<int> numbers;
  std::vector<std::size_t> jumps;
  Player player;
  Utime wall = 777 * second;

  explicit Played(const PlayerOptions& options = {})
      : player(
            index, options,
            [this](const logs::LogEvent& event) { numbers.push_back(event.data[0]); },
            [this](std::size_t place) { jumps.push_back(place); }) {
    player.start(wall);
  }
  /// Runs at the times the player requests, until this one.
  void play(Utime duration) {
    const Utime end = wall + duration;
    while (const auto due = player.next_due()) {
      if (*due > end) break;
      wall = std::max(wall, *due);
      player.run(wall);
    }
    wall = end;
    player.run(wall);
  }
};

}  // namespace

TEST_CASE("Messages are played at their times from each other, and the tail is not lost") {
  Played played;
  std::vector<Utime> walls;
  const Utime begin = played.wall;
  while (const auto due = played.player.next_due()) {
    played.wall = *due;
    played.player.run(*due);
    walls.resize(played.numbers.size(), *due - begin);
  }
  REQUIRE(played.numbers.size() == 101);
  for (std::size_t i = 0; i < 101; ++i) {
    CHECK(played.numbers[i] == static_cast<int>(i + 1));
    CHECK(walls[i] == played.index.time(i) - played.index.first());
  }
  CHECK(played.player.finished());
}

TEST_CASE("A late player makes up for it and does not drift") {
  Played played;
  played.player.run(played.wall + 95 * millisecond);  // requested at 0, 10, 20 ...
  CHECK(played.numbers.size() == 10);
  CHECK(*played.player.next_due() == played.wall + 100 * millisecond);
}

TEST_CASE("The rate scales the times, and may change while it plays") {
  PlayerOptions options;
  options.rate = 2;
  Played played(options);
  played.play(100 * millisecond);
  CHECK(played.numbers.size() == 21);
  played.player.change_rate(0.25, played.wall);
  CHECK(played.player.rate() == 0.5);
  played.play(100 * millisecond);
  CHECK(played.numbers.size() == 26);
  for (int i = 0; i < 30; ++i) played.player.change_rate(2, played.wall);
  CHECK(played.player.rate() == 1024);
}

TEST_CASE("A pause holds the place, to the message") {
  Played played;
  played.play(105 * millisecond);
  REQUIRE(played.numbers.size() == 11);
  played.player.pause_or_go(played.wall);
  CHECK(!played.player.next_due());
  played.play(10 * second);
  CHECK(played.numbers.size() == 11);
  played.player.pause_or_go(played.wall);
  CHECK(*played.player.next_due() == played.wall + 5 * millisecond);
  played.play(5 * millisecond);
  CHECK(played.numbers.back() == 12);
}

TEST_CASE("Steps go message by message or to the next estimate, and leave none out") {
  Played played;
  played.play(0);
  played.player.step(played.wall);
  CHECK(played.player.paused());
  CHECK(played.numbers == std::vector<int>{1, 2});
  played.player.step_to("POSE_ESTIMATE", played.wall);
  CHECK(played.numbers.size() == 6);
  played.player.step_to("POSE_ESTIMATE", played.wall);
  CHECK(played.numbers.size() == 16);
  CHECK(played.player.position(played.wall) == 150 * millisecond);
  for (int i = 0; i < 200; ++i) played.player.step_to("POSE_ESTIMATE", played.wall);
  CHECK(played.numbers.size() == 101);
  CHECK(played.numbers.back() == 101);
  played.player.step(played.wall);
  CHECK(played.numbers.size() == 101);
}

TEST_CASE("Seeking goes on from another place, at either end too") {
  Played played;
  played.play(100 * millisecond);
  const std::size_t before = played.numbers.size();
  played.player.seek(500 * millisecond, played.wall);
  CHECK(played.numbers.size() == before);
  CHECK(played.jumps == std::vector<std::size_t>{60});
  played.play(0);
  CHECK(played.numbers.back() == 61);
  played.player.seek(-10 * second, played.wall);
  played.play(0);
  CHECK(played.numbers.back() == 1);
  played.player.seek(second * 1000, played.wall);
  played.play(0);
  CHECK(played.numbers.back() == 101);
  CHECK(played.player.finished());
  played.player.seek(-second, played.wall);
  CHECK(!played.player.finished());
}

TEST_CASE("A silent gap shows how long it lasts") {
  Played played;
  played.play(2 * second);
  CHECK(played.player.position(played.wall) == 2 * second);
  CHECK(*played.player.until_next(played.wall) == 9 * second);
  CHECK(!played.player.finished());
  played.play(9 * second);
  CHECK(played.numbers.back() == 101);
  CHECK(!played.player.until_next(played.wall));
}

TEST_CASE("A part is played, again and again") {
  PlayerOptions options;
  options.from = 100 * millisecond;
  options.to = 200 * millisecond;
  Played once(options);
  once.play(second);
  CHECK(once.numbers.size() == 10);
  CHECK(once.numbers.front() == 11);
  CHECK(once.player.finished());
  options.loop = true;
  Played loop(options);
  loop.play(365 * millisecond);
  CHECK(loop.numbers.size() > 30);
  CHECK(loop.jumps.size() >= 3);
  CHECK(!loop.player.finished());
  loop.player.loop_or_not();
  loop.play(second);
  CHECK(loop.player.finished());
  CHECK(loop.numbers.size() % 10 == 0);
}

TEST_CASE("Where the clock was set messages go on at their pace, and it is reported") {
  const Utime by = GENERATE(-30 * second, 3600 * second, -20 * 365 * 24 * 3600 * second);
  std::vector<Message> messages;
  for (int i = 0; i < 200; ++i) {
    messages.push_back({made::start + i * 10 * millisecond + (i < 100 ? 0 : by), "A"});
  }
  MadeLog log(messages);
  const LogIndex index(log.path);
  REQUIRE(index.steps().size() == 1);
  CHECK(index.steps()[0].event == 100);
  std::size_t played = 0;
  Player player(index, {}, [&](const logs::LogEvent&) { ++played; });
  player.start(0);
  for (int i = 1; i <= 200; ++i) {
    const std::size_t before = played;
    player.run(i * 10 * millisecond - 1);
    CHECK(played - before <= 2);  // no burst
    CHECK(played + 2 >= static_cast<std::size_t>(i));
  }
  CHECK(player.finished());
  CHECK(player.position(10 * second) == 1980 * millisecond);
}

TEST_CASE("Damage does not stop the index, nor a wrong time the player") {
  std::vector<Message> messages;
  for (int i = 0; i < 50; ++i) messages.push_back({made::start + i * millisecond, "A"});
  messages[20].utime += 1000000 * second;
  messages[30].utime = 5;
  messages[40].utime -= 3 * millisecond;
  MadeLog log(messages);
  const LogIndex index(log.path);
  REQUIRE(index.size() == 50);
  for (std::size_t i = 0; i < 50; ++i) {
    INFO(i);
    CHECK(std::abs(index.time(i) - made::start - static_cast<Utime>(i) * millisecond) <=
          3 * millisecond);
    if (i > 0) CHECK(index.time(i) >= index.time(i - 1));
  }

  std::string bytes = read_file(log.path);
  bytes[10 * 30] ^= 0x40;
  bytes.resize(bytes.size() - 3);
  std::ofstream(log.path, std::ios::binary) << bytes;
  const LogIndex damaged(log.path);
  CHECK(damaged.size() >= 48);
  CHECK(damaged.damaged_bytes() > 0);
  CHECK_THROWS_AS(LogIndex(log.folder / "none.lcm"), InputError);
}

TEST_CASE("The index has channels, sessions and progress") {
  TemporaryDirectory folder;
  {
    logs::LogWriter log(folder / "beats.lcm");
    for (int i = 0; i < 10000; ++i) {
      heartbeat_t beat{};
      beat.session = 7 + i % 2;
      beat.node = "n";
      std::vector<std::uint8_t> bytes(static_cast<std::size_t>(beat.getEncodedSize()));
      beat.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
      log.write(i, "HEARTBEAT", bytes);
    }
  }
  double last = 0;
  const LogIndex index(folder / "beats.lcm", [&last](double share) {
    CHECK(share > last);
    last = share;
  });
  CHECK(last > 0.5);
  CHECK(last <= 1);
  CHECK(index.sessions() == std::set<std::int64_t>{7, 8});
  CHECK(index.next_of("HEARTBEAT", 17) == 17);
  CHECK(index.next_of("OTHER", 0) == index.size());
  CHECK(index.not_before(5000) == 5000);
  CHECK(index.at(5000).channel == "HEARTBEAT");
}

TEST_CASE("Channels are left out and renamed") {
  const ChannelMap map({"A=B"}, "A|ARM_.*", "ARM_STATE.*");
  CHECK(map.name_of("A") == "B");
  CHECK(map.name_of("ARM_COMMAND") == "ARM_COMMAND");
  CHECK(!map.name_of("ARM_STATE_REPLICA"));
  CHECK(!map.name_of("AB"));
  CHECK_THROWS_AS(ChannelMap({"A"}, "", ""), InputError);
  CHECK_THROWS_AS(ChannelMap({"A=" + std::string(70, 'B')}, "", ""), InputError);
  CHECK_THROWS_AS(ChannelMap({}, "(", ""), InputError);
}

TEST_CASE("Live estimates are compared with the recorded ones of the same returns") {
  std::vector<std::string> lines;
  EstimatePairs pairs(made::start, [&lines](const std::string& line) { lines.push_back(line); });
  for (int i = 1; i <= 3; ++i) {
    auto recorded = made::estimate(made::start + i * second, made::flight(i));
    recorded.scan_id = i;
    auto live = recorded;
    live.seq += 100;
    if (i == 2) live.position_m[0] += 0.0015;
    if (i == 3) live.status = pose_estimate_t::LOST;
    if (i == 2) pairs.live(live);  // whichever comes first
    pairs.recorded(recorded);
    if (i != 2) pairs.live(live);
  }
  REQUIRE(lines.size() == 3);
  CHECK_THAT(lines[0], Catch::EndsWith("same"));
  CHECK_THAT(lines[1], Catch::EndsWith("1.500 mm 0.0000 deg"));
  CHECK_THAT(lines[2], Catch::Contains("OK        LOST"));
  CHECK(pairs.pairs() == 3);
  CHECK(pairs.same() == 1);
  CHECK_THAT(pairs.summary(), Catch::Contains("at most 1.500 mm"));

  auto lone = made::estimate(made::start, made::flight(0));
  lone.scan_id = 9;
  pairs.recorded(lone);
  pairs.forget();
  pairs.live(lone);
  CHECK(pairs.pairs() == 3);
}
