// SPDX-License-Identifier: BSD-3-Clause
#include <berth/ground_truth_t.hpp>
#include <berth/heartbeat_t.hpp>

#include "common/core/error.h"
#include "evaluation/run/place_in_log.h"
#include "logs/file/log_reader.h"
#include "logs/inspect/excerpt.h"
#include "logs/inspect/inspection.h"
#include "logs/inspect/log_diff.h"
#include "logs/inspect/repair.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"
#include "test/logs/file/made_log.h"

using namespace berth;
using namespace berth::logs;

namespace {

heartbeat_t heartbeat(const char* node, std::int64_t seq) {
  heartbeat_t m{};
  m.utime = made::start + seq * second / 20;
  m.seq = seq;
  m.session = made::session;
  m.node = node;
  return m;
}

/// Two nodes' heartbeats and truth, but for those whose seq is left out.
void write_beats(const std::filesystem::path& path, std::set<std::int64_t> left_out = {}) {
  LogWriter writer(path);
  for (std::int64_t seq = 1; seq <= 100; ++seq) {
    const Utime utime = made::start + seq * second / 20;
    if (left_out.contains(seq)) continue;
    write_message(writer, utime, "HEARTBEAT", heartbeat("a", seq));
    write_message(writer, utime + 1, "HEARTBEAT", heartbeat("b", 1000 + seq));
    auto truth = made::truth(utime, made::flight(static_cast<double>(seq) / 20));
    truth.seq = seq;
    write_message(writer, utime + 2, "GROUND_TRUTH", truth);
  }
}

}  // namespace

TEST_CASE("a whole log is sound, with its channels, types, rates and sessions") {
  TemporaryFile file;
  write_beats(file.path);
  const Inspection i = inspect(file.path, our_types());
  CHECK(i.sound());
  CHECK(i.findings.empty());
  CHECK(i.events == 300);
  REQUIRE(i.channels.size() == 2);
  const ChannelTally& beats = i.channels.at("HEARTBEAT");
  CHECK(beats.messages() == 200);
  CHECK(beats.type()->name == "berth.heartbeat_t");
  CHECK(i.channels.at("GROUND_TRUTH").rate_hz() == Approx(20));
  CHECK(i.channels.at("GROUND_TRUTH").max_pause() == second / 20);
  CHECK(i.sessions == std::map<std::int64_t, std::int64_t>{{made::session, 300}});
  CHECK(json_of(i)["channels"][1]["types"][0]["type"] == "berth.heartbeat_t");
  CHECK(text_of(i).find("heartbeat_t") != std::string::npos);
}

TEST_CASE("missing messages are reported per channel and sender, with their place") {
  TemporaryFile file;
  write_beats(file.path, {50, 51});
  const Inspection i = inspect(file.path, our_types());
  CHECK_FALSE(i.sound());
  CHECK(i.sound(false));
  CHECK(i.missing_events == 0);  // the logger never had them
  CHECK(i.missing_messages() == 6);
  CHECK(i.channels.at("HEARTBEAT").missing() == 4);
  REQUIRE(i.findings.size() == 3);
  CHECK(i.findings[0].kind == Finding::Kind::gap);
  CHECK(i.findings[0].count == 2);
  CHECK(i.findings[0].event == 147);
  CHECK(i.findings[2].channel == "GROUND_TRUTH");
}

TEST_CASE("damage anywhere in a log costs the message it hit, is reported, and is repaired") {
  TemporaryFile file;
  write_beats(file.path);
  const auto good = bytes_of(file.path);
  LogReader reader(file.path);
  std::vector<std::size_t> begins;
  std::vector<std::size_t> data_begins;
  LogEvent event;
  while (reader.next(event)) {
    begins.push_back(event.offset);
    data_begins.push_back(event.offset + format::header_bytes + event.channel.size());
  }
  std::mt19937 random(5);
  for (int trial = 0; trial < 60; ++trial) {
    auto bytes = good;
    const std::size_t hit = 1 + random() % (begins.size() - 2);
    const int what = trial % 4;
    if (what == 0) bytes[begins[hit]] ^= 0x10;             // sync word
    if (what == 1) bytes[begins[hit] + 22] ^= 0x40;        // length of the channel
    if (what == 2) bytes[data_begins[hit] + 3] ^= 0x01;    // fingerprint
    if (what == 3) bytes[data_begins[hit] + 15 + 8] ^= 2;  // seq
    overwrite(file.path, bytes);
    const Inspection i = inspect(file.path, our_types());
    INFO("trial " << trial << ", event " << hit);
    CHECK_FALSE(i.sound());
    REQUIRE_FALSE(i.findings.empty());
    CHECK(i.findings[0].offset == begins[hit]);
    TemporaryFile mended;
    const Repair r = repair(file.path, mended.path, our_types());
    const Inspection after = inspect(mended.path, our_types());
    CHECK(after.damaged_bytes == 0);
    if (what < 2) {
      CHECK(i.findings[0].kind == Finding::Kind::damage);
      CHECK(i.missing_events == 1);
      CHECK(r.written == 299);
      CHECK(r.damaged_bytes == begins[hit + 1] - begins[hit]);
      CHECK(after.sound(false));
      CHECK(after.missing_events == 1);  // the sequence numbers still show it
    } else if (what == 2) {
      CHECK(i.undecodable() == 1);
      CHECK(r.written == 299);
      CHECK(r.dropped == 1);
      CHECK(after.sound(false));
    } else {
      CHECK(r.written == 300);
    }
  }
}

TEST_CASE("a damaged length within a message drops that message alone") {
  TemporaryFile file;
  write_beats(file.path);
  auto bytes = bytes_of(file.path);
  LogReader reader(file.path);
  LogEvent event;
  for (int n = 0; n < 31; ++n) REQUIRE(reader.next(event));
  REQUIRE(event.channel == "HEARTBEAT");
  bytes[event.offset + format::header_bytes + 9 + 32 + 3] = 77;  // length of the node's name
  overwrite(file.path, bytes);
  TemporaryFile out;
  const Repair r = repair(file.path, out.path, our_types());
  CHECK(r.written == 299);
  CHECK(r.dropped == 1);
  REQUIRE(r.findings.size() == 1);
  CHECK(r.findings[0].offset == event.offset);
  CHECK(inspect(out.path, our_types()).undecodable() == 0);
  CHECK_THROWS_AS(repair(file.path, out.path, our_types()), InputError);  // never overwrites
}

TEST_CASE("a damaged event number, a late one and a restart are no gaps") {
  SequenceCounter counter;
  using Step = SequenceCounter::Step;
  for (const std::int64_t n : {1, 2, 3}) CHECK(counter.take(n) == Step::next);
  CHECK(counter.take(1 << 20) == Step::gap);
  CHECK(counter.take(5) == Step::corrected);
  CHECK(counter.missing() == 0);
  CHECK(counter.take(5) == Step::repeat);
  CHECK(counter.take(9) == Step::gap);
  CHECK(counter.missing_before() == 3);
  CHECK(counter.take(8) == Step::late);
  CHECK(counter.missing() == 2);
  CHECK(counter.take(10) == Step::next);
  CHECK(counter.take(INT64_MAX) == Step::gap);
  CHECK(counter.take(12) == Step::corrected);
  CHECK(counter.missing() == 2);
  SequenceCounter restarted;
  for (const std::int64_t n : {7, 8, 1, 2, 3}) restarted.take(n);
  CHECK(restarted.missing() == 0);
}

TEST_CASE("an excerpt has the requested channels and time") {
  TemporaryFile file;
  write_beats(file.path);
  const auto written = [&](const Excerpt& excerpt) {
    TemporaryFile out;
    write_excerpt(file.path, out.path, excerpt);
    const Inspection i = inspect(out.path, our_types());
    CHECK(i.sound());
    std::map<std::string, std::int64_t> counts;
    for (const auto& [name, channel] : i.channels) counts[name] = channel.messages();
    return counts;
  };
  using Counts = std::map<std::string, std::int64_t>;
  CHECK(written({.include = "GROUND.*"}) == Counts{{"GROUND_TRUTH", 100}});
  CHECK(written({.exclude = "GROUND"}).size() == 2);  // the whole name must match
  CHECK(written({.exclude = "GROUND_TRUTH"}) == Counts{{"HEARTBEAT", 200}});
  LogReader reader(file.path);
  const Timeline timeline(reader);
  const auto place = [&](const char* text) {
    return evaluation::place_in_log(file.path, timeline, text, false);
  };
  const Utime from = place("1.0");
  CHECK(from == second);
  CHECK(place("1500 ms") == from + second / 2);
  CHECK(place("1763730000000000") == timeline.duration() + 1);  // after all of it
  CHECK_THROWS_AS(place("17637300000000000000000"), InputError);
  CHECK(written({.from = from, .to = from + second}) ==
        Counts{{"HEARTBEAT", 41}, {"GROUND_TRUTH", 20}});
  CHECK(written({.from = from, .to = from + second, .keep = "HEARTBEAT"}) ==
        Counts{{"HEARTBEAT", 200}, {"GROUND_TRUTH", 20}});
  CHECK_THROWS_AS(place("approach"), InputError);
  CHECK_THROWS_AS(written({.include = "("}), InputError);
}

TEST_CASE("an excerpt across a step of the clock has what a reader of the log sees") {
  TemporaryFile file;
  {
    LogWriter writer(file.path);
    for (int i = 0; i < 200; ++i) {  // set back by 30 s after 10 s
      const Utime clock = made::start + i * second / 10 - (i < 100 ? 0 : 30 * second);
      writer.write(clock, "A", std::vector<std::uint8_t>{1});
    }
  }
  TemporaryFile out;
  const ExcerptResult result =
      write_excerpt(file.path, out.path, {.from = 8 * second, .to = 12 * second});
  CHECK(result.written == 42);  // no time passed where the clock was set
  REQUIRE(result.steps.size() == 1);
  CHECK(result.steps[0].position == 9900 * millisecond);

  const Inspection i = inspect(file.path, our_types());
  CHECK(i.sound());
  CHECK(i.steps == 1);
  CHECK(i.duration_s() == Approx(19.8));
  CHECK(i.channels.at("A").rate_hz() == Approx(199 / 19.8));
  REQUIRE(i.findings.size() == 1);
  CHECK(i.findings[0].kind == Finding::Kind::step);
  CHECK_THAT(i.findings[0].text(), Catch::EndsWith("the clock was set back by 29.900 s"));
  CHECK_THAT(summary_of(i), Catch::EndsWith("1 step of its clock"));
}

TEST_CASE("repair keeps every event that is whole, whatever its channel and type") {
  TemporaryFile file;
  {
    LogWriter writer(file.path);
    for (int i = 0; i < 3; ++i) {
      const Utime utime = made::start + i;
      writer.write(utime, "MY CHANNEL", std::vector<std::uint8_t>(20, 7));
      writer.write(utime, "caf\xC3\xA9", std::vector<std::uint8_t>{1, 2, 3});
      writer.write(utime, "EMPTY", {});
      write_message(writer, utime, "MIXED", heartbeat("a", i + 1));
      writer.write(utime, "MIXED", std::vector<std::uint8_t>(30, 9));  // of a type of others
    }
  }
  const auto good = bytes_of(file.path);
  TemporaryFile out;
  const Repair whole = repair(file.path, out.path, our_types());
  CHECK(whole.written == 15);
  CHECK(whole.dropped == 0);
  CHECK(bytes_of(out.path) == good);
  const Inspection i = inspect(file.path, our_types());
  CHECK(i.damaged_bytes == 0);
  CHECK(i.channels.at("EMPTY").unknown() == 3);
  CHECK(i.channels.at("caf\xC3\xA9").undecodable() == 0);
}

TEST_CASE("two logs are compared by seq and sender; times, fields and a tolerance may not count") {
  TemporaryFile a;
  TemporaryFile b;
  const auto write = [](const std::filesystem::path& path, Utime shift, double error, int lost) {
    LogWriter writer(path);
    for (int seq = 1; seq <= 50; ++seq) {
      if (seq == lost) continue;
      auto truth = made::truth(made::start + seq + shift, made::flight(seq));
      truth.seq = seq;
      if (seq == 40) truth.position_m[1] += error;
      write_message(writer, made::start + seq + shift, "GROUND_TRUTH", truth);
      write_message(writer, made::start + seq + shift, "HEARTBEAT", heartbeat("a", seq));
    }
  };
  write(a.path, 0, 0, 0);
  write(b.path, 1000, 1e-6, 7);
  const auto diff = [&](const DiffOptions& options) {
    return diff_logs(a.path, b.path, our_types(), options);
  };
  CHECK(equal(diff_logs(a.path, a.path, our_types(), {})));
  const LogDiff strict = diff({});
  CHECK(strict.at("GROUND_TRUTH").different == 49);
  CHECK(strict.at("GROUND_TRUTH").only_a == 1);
  CHECK(strict.at("GROUND_TRUTH").field == "utime");
  CHECK(strict.at("HEARTBEAT").same == 49);
  DiffOptions options;
  options.ignore_times = true;
  const ChannelDiff one = diff(options).at("GROUND_TRUTH");
  CHECK(one.different == 1);
  CHECK(one.field == "position_m[1]");
  CHECK(one.utime_a == made::start + 40);
  CHECK(one.largest == Approx(1e-6));
  options.tolerance = 2e-6;
  CHECK(diff(options).at("GROUND_TRUTH").different == 0);
  CHECK_FALSE(equal(diff(options)));  // one is missing
  options.tolerance = 0;
  options.ignore_fields = "position_m.*";
  CHECK(diff(options).at("GROUND_TRUTH").different == 0);
  options.channels = "EVENT";
  CHECK(equal(diff(options)));
}
