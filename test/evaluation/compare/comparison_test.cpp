// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/compare/comparison.h"

#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "common/core/error.h"
#include "common/core/random.h"
#include "common/core/sha256.h"
#include "evaluation/compare/junit.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_writer.h"
#include "test/catch.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;
using namespace berth::evaluation;

namespace {

namespace fs = std::filesystem;

struct TemporaryFolder {
  fs::path path = fs::temp_directory_path() / ("berth-compare-" + std::to_string(::getpid()));
  TemporaryFolder() { fs::create_directories(path); }
  ~TemporaryFolder() { fs::remove_all(path); }
};

template <class Message>
void write(logs::LogWriter& log, const char* channel, const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  log.write(message.utime, channel, bytes);
}

const std::string made_procedure =
    "name: made\ncriteria:\n"
    "  - {name: z, measurement: z_error, statistic: mean, phase: go, min: 0 mm, max: 10 mm}\n"
    "  - {name: near, measurement: surface_range, statistic: min, min: 3 m}\n";

/// A run wrong by 5 mm along z for 10 s, and the verdict its engine would have given, but for
/// `edit`.
void write_run(const fs::path& path, std::int64_t other_session = 0, bool with_text = true,
               const std::function<void(procedure_state_t&)>& edit = {},
               const std::string& text = made_procedure) {
  RunRecord record;
  logs::LogWriter log(path);
  run_info_t info{};
  info.utime = made::start;
  info.session = made::session;
  info.run = "made-run";
  info.host = run_info_t::TWIN;
  info.procedure = "made";
  info.layout = "range";
  info.target = "no-such-target.ply";
  attachment_t procedure{};
  procedure.name = "procedure.yaml";
  procedure.sha256 = sha256(text);
  if (with_text) procedure.content = text;
  info.attachments = {procedure};
  info.attachment_count = 1;
  write(log, channels::run_info, info);
  for (int i = 0; i <= 1250; ++i) {
    const Utime t = i * 8 * millisecond;
    const auto truth = made::truth(made::start + t, made::flight(seconds(t)));
    record.add(truth);
    write(log, channels::ground_truth, truth);
    if (i % 50 != 25) continue;
    Vector6d error = Vector6d::Zero();
    error(2) = 5e-3;
    auto estimate = made::estimate(made::start + t, perturbed(made::flight(seconds(t)), error));
    record.add(estimate);
    write(log, channels::pose_estimate, estimate);
    if (other_session != 0) {
      estimate.session = other_session;
      estimate.position_m[2] += 1;
      estimate.seq += 1;
      write(log, channels::pose_estimate, estimate);
    }
  }
  auto state = made::state({{"go", 0, 10}});
  record.add(state);
  Config config = Config::parse(made_procedure, "p");
  state.criteria = judge(read_criteria(config), Measurer(record, {}));
  state.criterion_count = static_cast<std::int32_t>(state.criteria.size());
  state.outcome = outcome_of(state.criteria);
  if (edit) edit(state);
  write(log, channels::procedure_state, state);
}

}  // namespace

TEST_CASE("compare gives the recorded verdict again, from the log alone") {
  TemporaryFolder folder;
  write_run(folder.path / "run.lcm");
  const Comparison c = compare_log(folder.path / "run.lcm");
  CHECK(c.agrees);
  CHECK(c.outcome == procedure_state_t::INCONCLUSIVE);  // the target's mesh is not at hand
  REQUIRE(c.criteria.size() == 2);
  CHECK(c.criteria[0].result == criterion_result_t::PASSED);
  CHECK(c.criteria[0].value == Approx(5));
  CHECK(c.criteria[1].result == criterion_result_t::INCONCLUSIVE);
  REQUIRE(c.phases.size() == 2);
  CHECK(c.phases[0].phase == "go");
  CHECK(c.phases[0].estimates == 25);
  CHECK(c.summary.damaged_bytes == 0);

  const std::string text = verdict_text(c);
  CHECK(text.find("verdict: INCONCLUSIVE; reproduced from the log: identical") !=
        std::string::npos);
  CHECK(text.find("position_error") == std::string::npos);
  CHECK(measurements_text(c).find("position_error") != std::string::npos);
  CHECK(heading_of(c).find("no-such-target.ply") != std::string::npos);
  const auto json = nlohmann::json::parse(json_of(c));
  CHECK(json["criteria"][0]["value"].get<double>() == c.criteria[0].value);
  CHECK(json["criteria"][1]["value"].is_null());
  CHECK(json["agrees_with_recorded"] == true);
  CHECK(json["phases"][0]["measurements"]["z_error"]["mean"].get<double>() == Approx(5));
}

TEST_CASE("the criteria are judged again where the run went on past a step that failed") {
  TemporaryFolder folder;
  const auto outcome = [&](std::int8_t recorded, const std::string& reason) {
    write_run(folder.path / "run.lcm", 0, true, [&](procedure_state_t& state) {
      state.steps.front().state = procedure_step_t::TIMEOUT;
      state.outcome = recorded;
      state.reason = reason;
    });
    return compare_log(folder.path / "run.lcm").outcome;
  };
  // by what the log holds, which is INCONCLUSIVE, whatever was recorded
  CHECK(outcome(procedure_state_t::PASS, "") == procedure_state_t::INCONCLUSIVE);
  CHECK(outcome(procedure_state_t::FAIL, "") == procedure_state_t::INCONCLUSIVE);
  // a step, a limit, the rig, a person decided
  CHECK(outcome(procedure_state_t::FAIL, "limit 'a'") == procedure_state_t::FAIL);
  CHECK(outcome(procedure_state_t::TIMEOUT, "step 'go'") == procedure_state_t::TIMEOUT);
  CHECK(outcome(procedure_state_t::ERROR, "testbed fault") == procedure_state_t::ERROR);
  CHECK(outcome(procedure_state_t::ABORTED, "aborted") == procedure_state_t::ABORTED);
}

TEST_CASE("each procedure of a cell that is up is judged by its own criteria over its own time") {
  TemporaryFolder folder;
  const std::string looser =
      "name: other\ncriteria:\n"
      "  - {name: z of other, measurement: z_error, statistic: mean, phase: "
      "go, min: 15 mm, max: 25 mm}\n";
  const auto write_second = [&](std::int64_t session, bool with_info) {
    logs::LogWriter log(folder.path / "two.lcm");
    // one after the other: wrong by 5 mm, then by 20 mm
    for (int number = 0; number < 2; ++number) {
      const Utime begin = made::start + number * 30 * second;
      const bool second_one = number == 1;
      const auto of_session = [&](auto message) {
        if (second_one) message.session = session;
        return message;
      };
      run_info_t info{};
      info.utime = begin;
      info.session = made::session;
      info.run = second_one ? "run-2" : "run-1";
      info.procedure = second_one ? "other" : "made";
      attachment_t text{};
      text.name = "procedure.yaml";
      text.content = second_one ? looser : made_procedure;
      info.attachments = {text};
      info.attachment_count = 1;
      if (!second_one || with_info) write(log, channels::run_info, of_session(info));
      for (int i = 0; i <= 1250; ++i) {
        const Utime t = i * 8 * millisecond;
        const Pose pose = made::flight(seconds(t));
        write(log, channels::ground_truth, of_session(made::truth(begin + t, pose)));
        if (i % 50 != 25) continue;
        Vector6d error = Vector6d::Zero();
        error(2) = second_one ? 20e-3 : 5e-3;
        write(log, channels::pose_estimate,
              of_session(made::estimate(begin + t, perturbed(pose, error))));
      }
      procedure_state_t state = made::state({{"go", 0, 10}});
      state.procedure = info.procedure;
      state.utime_start = begin;
      state.utime += begin - made::start;
      state.steps.front().utime_start += begin - made::start;
      state.steps.front().utime_end += begin - made::start;
      write(log, channels::procedure_state, of_session(state));
    }
  };
  const auto check_both = [&] {
    const auto runs = compare_runs(folder.path / "two.lcm");
    REQUIRE(runs.size() == 2);
    const Comparison& one = runs[0].comparison;
    CHECK(one.info->run == "run-1");
    REQUIRE(one.criteria.size() == 2);
    CHECK(one.criteria[0].name == "z");
    CHECK(one.criteria[0].value == Approx(5));
    CHECK(one.criteria[0].samples == 25);
    CHECK(one.phases[0].estimates == 25);
    const Comparison& other = runs[1].comparison;
    CHECK(other.info->run == "run-2");
    REQUIRE(other.criteria.size() == 1);
    CHECK(other.criteria[0].name == "z of other");
    CHECK(other.criteria[0].value == Approx(20));
    CHECK(other.outcome == procedure_state_t::PASS);
    CHECK(compare_log(folder.path / "two.lcm").info->run == "run-2");
  };
  SECTION("in one session") {
    write_second(made::session, true);
    check_both();
  }
  SECTION("in two sessions") {
    write_second(made::session + 1, true);
    check_both();
  }
  SECTION("and never by those of another, where its own are missing") {
    write_second(made::session, false);
    const auto runs = compare_runs(folder.path / "two.lcm");
    REQUIRE(runs.size() == 2);
    CHECK(runs[0].comparison.criteria.size() == 2);
    CHECK(runs[1].comparison.criteria.empty());
    CHECK(runs[1].comparison.outcome == procedure_state_t::INCONCLUSIVE);
  }
}

TEST_CASE("what cannot be measured costs the criteria that use it, and nothing else") {
  RunRecord record;
  const auto broken = [](const Vector3d&) -> Vector3d { throw std::runtime_error("no mesh"); };
  TemporaryFolder folder;
  write_run(folder.path / "run.lcm");
  LogSummary summary;
  record = read_run(folder.path / "run.lcm", summary);
  const Comparison c = compare_record(record, broken);
  REQUIRE(c.criteria.size() == 2);
  CHECK(c.criteria[0].result == criterion_result_t::PASSED);
  CHECK(c.criteria[1].result == criterion_result_t::INCONCLUSIVE);
  CHECK(c.criteria[1].reason == "could not be measured: no mesh");
  CHECK(c.outcome == procedure_state_t::INCONCLUSIVE);
}

TEST_CASE("criteria that cannot be read leave open what they were to decide, and nothing else") {
  TemporaryFolder folder;
  const auto judged = [&](std::int8_t recorded, const std::string& reason) {
    write_run(
        folder.path / "run.lcm", 0, true,
        [&](procedure_state_t& state) {
          state.outcome = recorded;
          state.reason = reason;
          if (!reason.empty()) state.steps.front().state = procedure_step_t::ERROR;
        },
        "criteria: [{name: of another version, measurement: wobble, max: 1 mm}]\n");
    return compare_log(folder.path / "run.lcm");
  };
  const Comparison open = judged(procedure_state_t::PASS, "");
  CHECK(open.outcome == procedure_state_t::INCONCLUSIVE);
  CHECK(open.criteria.empty());
  CHECK_FALSE(open.agrees);
  CHECK(verdict_text(open).find("note: the criteria cannot be judged: ") != std::string::npos);
  CHECK(verdict_text(open).find("wobble") != std::string::npos);
  CHECK(verdict_text(open).find("DIFFERENT, recorded was PASS") != std::string::npos);
  CHECK(judged(procedure_state_t::ERROR, "testbed fault").outcome == procedure_state_t::ERROR);
  CHECK(judged(procedure_state_t::ABORTED, "by hand").outcome == procedure_state_t::ABORTED);
}

TEST_CASE("messages of another session do not count") {
  TemporaryFolder folder;
  write_run(folder.path / "run.lcm", 99);
  const Comparison c = compare_log(folder.path / "run.lcm");
  CHECK(c.agrees);
  CHECK(c.summary.other_session == 25);
}

TEST_CASE("a log cut off before its end is judged as far as it goes") {
  TemporaryFolder folder;
  const fs::path log = folder.path / "run.lcm";
  write_run(log);
  fs::resize_file(log, fs::file_size(log) - 10);  // the final state is gone
  const Comparison c = compare_log(log);
  CHECK_FALSE(c.agrees);
  CHECK(c.recorded_outcome == procedure_state_t::NONE);
  CHECK(verdict_text(c).find("the log holds no PROCEDURE_STATE") != std::string::npos);
  CHECK(c.summary.damaged_bytes > 0);
}

TEST_CASE("a log without a run is an error of the input") {
  TemporaryFolder folder;
  { logs::LogWriter log(folder.path / "empty.lcm"); }
  CHECK_THROWS_AS(compare_log(folder.path / "empty.lcm"), InputError);
  CHECK_THROWS_AS(compare_log(folder.path / "none.lcm"), InputError);
}

TEST_CASE("a log cut off anywhere is judged as far as it goes, and the missing part is reported") {
  TemporaryFolder folder;
  const fs::path whole = folder.path / "whole.lcm";
  const fs::path cut = folder.path / "cut.lcm";
  write_run(whole);
  Random random(11, "cut");
  const auto size = static_cast<double>(fs::file_size(whole));
  int judged = 0;
  for (int i = 0; i < 60; ++i) {
    // A third of them near the end, where a run that died is cut.
    const double place = i % 3 == 0 ? 1 - 1e-3 * random.uniform() : random.uniform();
    fs::copy_file(whole, cut, fs::copy_options::overwrite_existing);
    fs::resize_file(cut, static_cast<std::uintmax_t>(size * place));
    try {
      const Comparison c = compare_log(cut);
      ++judged;
      CHECK_FALSE(c.remarks.empty());
      CHECK(c.recorded_outcome == procedure_state_t::NONE);
      CHECK_FALSE(verdict_text(c).empty());
      CHECK_FALSE(junit_xml({junit_suite_of(c)}).empty());
      CHECK_NOTHROW(nlohmann::json::parse(json_of(c)));
    } catch (const InputError& e) {
      CHECK(std::string(e.what()).find("holds no run") != std::string::npos);
    }
  }
  CHECK(judged > 40);
}

TEST_CASE("a procedure too long for its message is read from the file next to the log") {
  TemporaryFolder folder;
  write_run(folder.path / "run.lcm", 0, false);
  CHECK(compare_log(folder.path / "run.lcm").criteria.empty());
  std::ofstream(folder.path / "procedure.yaml") << made_procedure;
  const Comparison c = compare_log(folder.path / "run.lcm");
  CHECK(c.criteria.size() == 2);
  CHECK(c.agrees);
  std::ofstream(folder.path / "procedure.yaml") << made_procedure << "# changed\n";
  CHECK(compare_log(folder.path / "run.lcm").criteria.empty());
}
