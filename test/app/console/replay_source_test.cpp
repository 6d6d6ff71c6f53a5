// SPDX-License-Identifier: BSD-3-Clause
// Recorded runs in the console: as of any time, and side by side.
#include "app/console/replay/replay_source.h"

#include "common/core/error.h"
#include "test/app/batch/recorded_run.h"
#include "test/app/console/written_board.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"

using namespace berth;
using namespace berth::console;

namespace {

constexpr Utime wall = 5000 * second;

const RunFiles& recorded() {
  static const TemporaryDirectory folder;
  static const RunFiles files = made::record_run(folder / "runs");
  return files;
}

struct Replayed {
  explicit Replayed(const std::filesystem::path& second = {})
      : source(recorded().directory, second, own_types(), board, wall) {}

  void obey(const char* command, const nlohmann::json& arguments = nlohmann::json::object()) {
    source.obey(command, arguments, now);
  }
  double position() { return board.sections["replay"].at("position_s"); }

  WrittenBoard board;
  Utime now = wall;
  ReplaySource source;
};

}  // namespace

TEST_CASE("samples of the whole run are there at once, each once") {
  Replayed replayed;
  const auto& samples = replayed.board.lists["samples"];
  REQUIRE(samples.size() > 10);
  double last = -1;
  std::size_t judged = 0;
  for (const auto& sample : samples) {
    CHECK(sample.at("time_s").get<double>() > last);
    last = sample.at("time_s");
    if (sample.contains("error")) ++judged;
  }
  CHECK(judged > 10);
  const std::size_t before = samples.size();
  replayed.source.run(wall + 5 * second);
  replayed.obey("seek", {{"position_s", 1.0}});
  CHECK(samples.size() == before);
}

TEST_CASE("after a jump the page shows what it would have shown when played to there") {
  Replayed played;
  Replayed jumped;
  const double to = 12.3;
  for (played.now = wall; played.now < wall + utime_from_seconds(to); played.now += second / 10) {
    played.source.run(played.now);
  }
  played.now = wall + utime_from_seconds(to);
  played.source.run(played.now);
  played.obey("pause");
  jumped.obey("pause");
  jumped.obey("seek", {{"position_s", 18.0}});
  jumped.obey("seek", {{"position_s", to}});
  for (const char* section : {"frames", "estimate", "truth", "scan", "run", "safe", "estimator"}) {
    INFO(section);
    CHECK(played.board.sections[section] == jumped.board.sections[section]);
  }
  CHECK(played.board.lists["returns"] == jumped.board.lists["returns"]);
  CHECK(played.board.lists["events"] == jumped.board.lists["events"]);
  for (const auto& node : jumped.board.sections["nodes"]) CHECK(node.at("gaps") == 0);
}

TEST_CASE("play, pause, rate, step, loop") {
  Replayed replayed;
  replayed.source.run(wall + 2 * second);
  CHECK(replayed.position() == Approx(2));
  replayed.now = wall + 2 * second;
  replayed.obey("pause");
  replayed.now += 5 * second;
  replayed.source.run(replayed.now);
  CHECK(replayed.position() == Approx(2));
  CHECK(replayed.board.sections["replay"].at("paused") == true);

  const auto estimate_then = replayed.board.sections["estimate"];
  replayed.obey("step", {{"channel", "POSE_ESTIMATE"}});
  CHECK(replayed.board.sections["estimate"] != estimate_then);
  const double stepped = replayed.position();
  replayed.obey("step");
  CHECK(replayed.position() >= stepped);
  CHECK(replayed.position() < stepped + 0.1);

  replayed.obey("rate", {{"factor", 4}});
  replayed.obey("play");
  const double from = replayed.position();
  replayed.source.run(replayed.now + second);
  CHECK(replayed.position() == Approx(from + 4).epsilon(1e-3));

  replayed.source.run(replayed.now + 60 * second);
  CHECK(replayed.position() == Approx(replayed.source.length_s()).epsilon(1e-3));
  CHECK(replayed.board.sections["replay"].at("paused") == true);
  replayed.now += 60 * second;
  replayed.obey("play");
  CHECK(replayed.position() < 1);
  replayed.obey("loop", {{"on", true}});
  replayed.source.run(replayed.now + 6 * second);
  CHECK(replayed.board.sections["replay"].at("paused") == false);
}

TEST_CASE("commands that a replay does not have are refused and change nothing") {
  Replayed replayed;
  const auto before = replayed.board.sections["replay"];
  CHECK_THROWS_AS(replayed.obey("hold"), InputError);
  CHECK_THROWS_AS(replayed.obey("seek"), InputError);
  CHECK_THROWS_AS(replayed.obey("seek", {{"position_s", "soon"}}), InputError);
  CHECK_THROWS_AS(replayed.obey("rate", {{"factor", 0}}), InputError);
  CHECK_THROWS_AS(replayed.obey("step", {{"channel", 3}}), InputError);
  CHECK_THROWS_AS(replayed.obey("loop", {{"on", "yes"}}), InputError);
  CHECK(replayed.board.sections["replay"] == before);
}

TEST_CASE("the time bar has the steps, and criteria not yet decided then are pending") {
  Replayed replayed;
  const auto& marks = replayed.board.sections["run"].at("marks");
  REQUIRE(marks.size() >= 2);
  CHECK(marks[0].at("text") == "acquire");
  CHECK(marks[1].at("end_s").get<double>() == Approx(19).epsilon(0.1));
  CHECK(replayed.position() == 0);
}

TEST_CASE("a run side by side with itself shows the same") {
  Replayed replayed(recorded().directory);
  replayed.obey("seek", {{"position_s", 15.0}});
  CHECK(replayed.board.sections["estimate2"] == replayed.board.sections["estimate"]);
  CHECK(replayed.board.sections["frames"].at("ghost2") ==
        replayed.board.sections["frames"].at("ghost"));
  CHECK(replayed.board.lists["samples2"] == replayed.board.lists["samples"]);
  CHECK(replayed.board.sections.count("arms2") == 0);
  replayed.source.run(wall + second);
  CHECK(replayed.board.sections["estimate2"].at("utime") ==
        replayed.board.sections["estimate"].at("utime"));
}
