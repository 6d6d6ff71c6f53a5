// SPDX-License-Identifier: BSD-3-Clause
#include "logs/file/timeline.h"

#include <algorithm>
#include <berth/heartbeat_t.hpp>
#include <limits>
#include <optional>

#include "logs/file/log_writer.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"
#include "test/logs/file/made_log.h"

using namespace berth;
using namespace berth::logs;

namespace {

constexpr Utime hour = 3600 * second;

struct Event {
  Utime utime;
  std::string channel = "A";
  std::vector<std::uint8_t> data = {1};
};

/// So many events from a time on, 10 ms from each other.
std::vector<Event> even(Utime from, int count) {
  std::vector<Event> events;
  for (int i = 0; i < count; ++i) events.push_back({from + i * 10 * millisecond});
  return events;
}

Event beat(Utime utime, std::int64_t seq) {
  heartbeat_t m{};
  m.utime = utime;
  m.seq = seq;
  m.session = made::session;
  m.node = "node";
  return {utime, "HEARTBEAT", encoded(m)};
}

/// Heartbeats of one node, from a time and a number on.
std::vector<Event> beats(Utime from, std::int64_t seq, int count) {
  std::vector<Event> events;
  for (int i = 0; i < count; ++i) events.push_back(beat(from + i * second / 20, seq + i));
  return events;
}

std::vector<Event> operator+(std::vector<Event> a, const std::vector<Event>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

struct PlacedLogs {
  explicit PlacedLogs(const std::vector<Event>& events) {
    {
      LogWriter writer(file.path);
      for (const Event& e : events) writer.write(e.utime, e.channel, e.data);
    }
    place_events();
  }
  /// Logs written one after the other into one file.
  explicit PlacedLogs(const std::vector<std::vector<Event>>& logs) {
    std::vector<std::uint8_t> bytes;
    for (const auto& events : logs) {
      const PlacedLogs one(events);
      const auto more = bytes_of(one.file.path);
      bytes.insert(bytes.end(), more.begin(), more.end());
    }
    overwrite(file.path, bytes);
    place_events();
  }
  void place_events() {
    LogReader reader(file.path);
    timeline.emplace(reader);
    Timeline::Walker walker(*timeline);
    LogEvent event;
    while (reader.next(event)) positions.push_back(walker.position(event.utime));
    CHECK(std::is_sorted(positions.begin(), positions.end()));
  }
  const std::vector<TimeStep>& steps() const { return timeline->steps(); }

  TemporaryFile file;
  std::optional<Timeline> timeline;
  std::vector<Utime> positions;
};

}  // namespace

TEST_CASE("a log whose clock was left alone has the times that it was received at", "[timeline]") {
  const auto events = beats(made::start, 1, 100) + even(made::start + 5 * second, 50);
  const PlacedLogs log(events);
  CHECK(log.steps().empty());
  CHECK(log.timeline->start() == made::start);
  for (std::size_t i = 0; i < events.size(); ++i) {
    CHECK(log.positions[i] == events[i].utime - made::start);
  }
  CHECK(log.timeline->duration() == events.back().utime - made::start);
  CHECK(log.timeline->first_position_of(made::start + second) == second);
  CHECK(log.timeline->last_position_of(made::start + second) == second);
  CHECK(log.timeline->last_position_of(made::start - 1) == -1);
  CHECK(log.timeline->first_position_of(made::start + hour) == log.timeline->duration() + 1);
}

TEST_CASE("a clock that was set back costs no time", "[timeline]") {
  const Utime by = GENERATE(second / 2, 30 * second, 10 * 365 * 24 * hour);
  const PlacedLogs log(even(made::start, 100) + even(made::start + second - by, 100));
  REQUIRE(log.steps().size() == 1);
  const TimeStep& step = log.steps()[0];
  CHECK(step.kind == TimeStep::Kind::back);
  CHECK(step.event == 100);
  CHECK(step.position == 990 * millisecond);
  CHECK(elapsed(step.before, step.after) == 10 * millisecond - by);
  CHECK(log.positions[150] == 1490 * millisecond);
  CHECK(log.timeline->duration() == 1980 * millisecond);
  CHECK_THAT(step.text(), Catch::StartsWith("at 0.990 s, event 100: the clock was set back by "));
}

TEST_CASE("heartbeats distinguish a clock that was set ahead from a silence", "[timeline]") {
  const Utime silence = GENERATE(2 * second, hour, 50 * 365 * 24 * hour);
  const auto before = beats(made::start, 1, 40);
  // They go on counting as if nothing had been:
  const PlacedLogs set(before + beats(before.back().utime + silence, 41, 40));
  REQUIRE(set.steps().size() == 1);
  CHECK(set.steps()[0].kind == TimeStep::Kind::ahead);
  CHECK(set.steps()[0].event == 40);
  CHECK(set.positions[60] == set.positions[39] + second);
  // As many of them are missing as fit into it:
  const PlacedLogs silent(before +
                          beats(before.back().utime + silence, 40 + silence / (second / 20), 40));
  CHECK(silent.steps().empty());
  CHECK(silent.positions[40] == silent.positions[39] + silence);
}

TEST_CASE("without heartbeats only a significantly long silence is a step", "[timeline]") {
  const auto before = even(made::start, 100);
  const auto after = [&](Utime silence) { return even(before.back().utime + silence, 100); };
  CHECK(PlacedLogs(before + after(hour)).steps().size() == 1);
  CHECK(PlacedLogs(before + after(hour)).positions[150] == 1490 * millisecond);
  CHECK(PlacedLogs(before + after(30 * second)).steps().empty());  // no step
  // Two of one size do not excuse each other.
  CHECK(
      PlacedLogs(before + after(hour) + even(before.back().utime + 2 * hour, 100)).steps().size() ==
      2);
  // A log that is silent again and again is like that.
  std::vector<Event> bursts;
  for (int i = 0; i < 30; ++i) bursts = bursts + even(made::start + i * 300 * second, 20);
  CHECK(PlacedLogs(bursts).steps().empty());
  CHECK(PlacedLogs(bursts).timeline->duration() == 29 * 300 * second + 190 * millisecond);
  // A few events are too few to estimate their rate.
  const std::vector<Event> few = {
      {made::start}, {made::start + 10 * second}, {made::start + 200 * second}};
  CHECK(PlacedLogs(few).steps().empty());
}

TEST_CASE("logs that were joined follow each other, parts of one log go on", "[timeline]") {
  const PlacedLogs days(std::vector{even(made::start, 100), even(made::start + 24 * hour, 100)});
  REQUIRE(days.steps().size() == 1);
  CHECK(days.steps()[0].kind == TimeStep::Kind::joined);
  CHECK(days.positions[150] == 1490 * millisecond);
  CHECK_THAT(days.steps()[0].text(),
             Catch::EndsWith("another recording follows, 86399.010 s later"));
  const PlacedLogs turned(std::vector{even(made::start, 100), even(made::start - 24 * hour, 100)});
  REQUIRE(turned.steps().size() == 1);
  CHECK(turned.steps()[0].kind == TimeStep::Kind::joined);
  const PlacedLogs split(std::vector{even(made::start, 100), even(made::start + second, 100)});
  CHECK(split.steps().empty());
  CHECK(split.positions[150] == 1500 * millisecond);
}

TEST_CASE("a single time that is out of line is no step", "[timeline]") {
  auto events = even(made::start, 100);
  events[20].utime += 24 * hour;
  events[40].utime = 5;
  events[60].utime = std::numeric_limits<Utime>::max();
  events[80].utime -= 30 * millisecond;
  const PlacedLogs log(events);
  CHECK(log.steps().empty());
  for (std::size_t i = 0; i < events.size(); ++i) {
    CHECK(std::abs(log.positions[i] - static_cast<Utime>(i) * 10 * millisecond) <=
          10 * millisecond);
  }
}

TEST_CASE("no time is too far away", "[timeline]") {
  constexpr Utime min_time = std::numeric_limits<Utime>::min();
  constexpr Utime max_time = std::numeric_limits<Utime>::max();
  CHECK(elapsed(min_time, max_time) == max_time);
  CHECK(elapsed(max_time, min_time) == min_time);
  CHECK(later(max_time, 1) == max_time);
  const std::vector<Event> far = {{min_time}, {max_time},     {0},       {max_time}, {min_time},
                                  {min_time}, {max_time - 1}, {max_time}};
  const PlacedLogs log(far);
  CHECK(log.positions.front() == 0);
  const PlacedLogs negative(even(-3600 * second, 50));
  CHECK(negative.positions.back() == 490 * millisecond);
  CHECK(PlacedLogs(std::vector<Event>{}).timeline->empty());
  CHECK(PlacedLogs(even(7, 1)).timeline->duration() == 0);
}

TEST_CASE("a time that was there twice has two places", "[timeline]") {
  const PlacedLogs log(even(made::start, 1000) + even(made::start + 5 * second, 1000));
  REQUIRE(log.steps().size() == 1);
  const Utime twice = made::start + 7 * second;
  CHECK(log.timeline->first_position_of(twice) == 7 * second);
  CHECK(log.timeline->last_position_of(twice) == 9990 * millisecond + 2 * second);
  // One that was skipped: from the event after it, up to the one before.
  const PlacedLogs ahead(even(made::start, 100) + even(made::start + hour, 100));
  CHECK(ahead.timeline->first_position_of(made::start + 60 * second) == 990 * millisecond);
  CHECK(ahead.timeline->last_position_of(made::start + 60 * second) == 990 * millisecond);
}
