// SPDX-License-Identifier: BSD-3-Clause
#include <stdlib.h>

#include <berth/procedure_state_t.hpp>
#include <berth/run_info_t.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/directory_lock.h"
#include "app/exit_code.h"
#include "app/runs/manifest.h"
#include "app/runs/run_files.h"
#include "app/runs/run_list.h"
#include "app/runs/verdict.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/mesh.h"
#include "common/targets/target.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_writer.h"
#include "procedures/engine/run_info.h"
#include "test/catch.h"
#include "test/common/core/temporary_directory.h"
#include "test/evaluation/measure/made_run.h"

using namespace berth;

namespace {

namespace fs = std::filesystem;

/// A run directory with what a list looks at.
fs::path make_run(const fs::path& parent, const std::string& name, const std::string& outcome,
                  double margin = 5) {
  const fs::path run = parent / name;
  fs::create_directories(run);
  write_file(run / "run.yaml", "name: x\n");
  write_file(run / "run.lcm", "log");
  write_file(run / manifest_file,
             R"({"created": "2026-11-2)" + name.substr(0, 1) +
                 R"(T10:00:00Z", "host": "twin", "procedure": "procedures/approach.yaml",
                   "target": "radarsat2", "seed": 7, "versions": {"berth": "1"}})");
  if (outcome.empty()) return run;
  write_file(run / "results.json",
             R"({"outcome": ")" + outcome + R"(", "duration_s": 12.5, "criteria": [
               {"name": "wide", "margin": 40, "min": null, "max": 50, "unit": "mm"},
               {"name": "close", "margin": )" +
                 std::to_string(margin) + R"(, "min": -10, "max": 100, "unit": "mm"}]})");
  return run;
}

RunRequest twin_of(const fs::path& out) {
  RunRequest request;
  request.procedure = "procedures/track_static.yaml";
  request.host = "twin";
  request.out = out;
  request.operator_name = "Ada";
  return request;
}

/// A log of a run that passed, of a procedure with this text.
void write_log(const RunFiles& files, const std::string& procedure) {
  logs::LogWriter log(files.log());
  const auto write = [&log](const char* channel, const auto& message) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    log.write(message.utime, channel, bytes);
  };
  run_info_t info{};
  info.utime = made::start;
  info.session = made::session;
  info.run = files.name;
  info.procedure = "made";
  attachment_t text{};
  text.name = "procedure.yaml";
  text.content = procedure;
  info.attachments = {text};
  info.attachment_count = 1;
  write(channels::run_info, info);
  write(channels::procedure_state, made::state({{"go", 0, 10}}));
}

}  // namespace

TEST_CASE("one command at a time in a directory; the second names the one at work there") {
  const TemporaryDirectory directory;
  const fs::path place = directory / "campaign";
  {
    const DirectoryLock lock(place);
    CHECK_THROWS_WITH(DirectoryLock(place),
                      Catch::Matchers::Contains(place.string() + ": another berth is at work") &&
                          Catch::Matchers::Contains("process " + std::to_string(getpid())));
  }
  const DirectoryLock again(place);
  write_checksums(place);  // the lock is no part of what is kept
  CHECK(read_file(place / "SHA256SUMS").empty());
}

TEST_CASE("a file is put in its place whole") {
  const TemporaryDirectory folder;
  write_file(folder / "a", "first");
  write_file(folder / "a", "second, longer");
  CHECK(read_file(folder / "a") == "second, longer");
  CHECK_FALSE(fs::exists(folder / "a.part"));
  CHECK_THROWS_AS(write_file(folder / "none" / "a", "x"), InputError);
  fs::create_directory(folder / "d");
  write_file(folder / "d" / "inside", "x");
  CHECK_THROWS_AS(write_file(folder / "d", "a directory stands there"), InputError);
  CHECK_FALSE(fs::exists(folder / "d.part"));
}

TEST_CASE("checksums show files that were changed, are missing, or came after") {
  const TemporaryDirectory folder;
  fs::create_directory(folder / "config");
  write_file(folder / "run.lcm", "log");
  write_file(folder / "config" / "a.yaml", "a: 1");
  CHECK_THROWS_AS(verify_checksums(folder.path()), InputError);
  write_checksums(folder.path());
  CHECK(verify_checksums(folder.path()).empty());
  // As sha256sum has it: SHA-256 of "log".
  CHECK(read_file(folder / checksums_file).find("  config/a.yaml\n") == 64);
  write_file(folder / "config" / "a.yaml", "a: 2");
  fs::remove(folder / "run.lcm");
  write_file(folder / "late", "");
  CHECK(verify_checksums(folder.path()) == std::vector<std::string>{"config/a.yaml was changed",
                                                                    "run.lcm is missing",
                                                                    "late is not listed"});
}

TEST_CASE("a run records the symmetry of its target, in a file and in RUN_INFO") {
  const TemporaryDirectory folder;
  const std::string mesh = (folder / "box.ply").string();
  save_ply(make_box({2, 1, 0.7}), mesh);
  RunRequest request = twin_of(folder / "runs");
  request.target = mesh;
  const RunFiles made = RunFiles::create(request);
  const std::string kept = read_file(made.directory / evaluation::symmetry_file);
  CHECK(read_symmetry(kept, "kept").motions.size() == 3);
  const run_info_t info =
      procedures::make_run_info(procedures::load_procedure(made.procedure()), made.setup,
                                load_target(made.setup.target, 0), "r", run_info_t::TWIN, "");
  const SymmetryGroup of_info = evaluation::symmetry_of_run(info);
  CHECK(yaml_of(of_info) == kept);
  request.target.clear();  // the replica has none
  CHECK(read_symmetry(read_file(RunFiles::create(request).directory / evaluation::symmetry_file),
                      "kept")
            .trivial());
}

TEST_CASE("a run's world: the operator's, else the procedure's, else simulation.yaml's") {
  const TemporaryDirectory folder;
  RunRequest request = twin_of(folder / "runs");
  const auto world = [&] {
    const fs::path config = RunFiles::create(request).directory / "config" / "simulation.yaml";
    return Config::load(config).text("world");
  };
  CHECK(world() == "lab");
  std::string text = read_file(request.procedure);
  text.insert(text.find("\nsteps:") + 1, "world: exact\n");
  request.procedure = folder / "in_exact.yaml";
  write_file(request.procedure, text);
  CHECK(world() == "exact");
  request.parameters["simulation.yaml:world"] = "wrong";
  CHECK(world() == "wrong");
  request.world = "harsh";
  CHECK(world() == "harsh");
  request.world = "mars";
  CHECK_THROWS_WITH(world(), Catch::Contains("--world: found 'mars', expected one of"));
}

TEST_CASE("everything known before the start is in the run's directory, and a mesh goes with it") {
  const TemporaryDirectory folder;
  const std::string mesh = (folder / "my target.ply").string();
  save_ply(load_target("radarsat2", 0).mesh, mesh);
  RunRequest request = twin_of(folder / "runs");
  request.target = mesh;
  request.target_length = 2;
  const RunFiles made = RunFiles::create(request);
  for (const char* file : {"run.yaml", "procedure.yaml", "config/testbed.yaml",
                           "target/my target.ply", "types/pose_estimate_t.lcm"}) {
    CHECK(fs::exists(made.directory / file));
  }
  const auto manifest = nlohmann::json::parse(read_file(made.directory / manifest_file));
  CHECK(manifest["operator"] == "Ada");
  CHECK(manifest["files"].contains("target/my target.ply"));
  CHECK(manifest["files"].contains("types/pose_estimate_t.lcm"));
  CHECK(manifest["message_types"].contains("berth.pose_estimate_t"));
  CHECK(manifest["versions"]["lcm"].get<std::string>().find("liblcm") == 0);

  // Elsewhere, and without the mesh that it came from, it is the same run.
  fs::remove(mesh);
  const fs::path moved = folder / "moved";
  fs::rename(made.directory, moved);
  const RunFiles opened = RunFiles::open(moved);
  CHECK(opened.setup.target == (moved / "target" / "my target.ply").string());
  CHECK(opened.configuration_hash == made.configuration_hash);
  CHECK(load_target(opened.setup.target, opened.setup.target_length).length == Approx(2));
}

TEST_CASE("runs are listed with outcome and worst margin, broken ones with the reason") {
  const TemporaryDirectory folder;
  setenv("XDG_RUNTIME_DIR", (folder / "runtime").c_str(), 1);
  make_run(folder.path(), "1_approach", "PASS");
  make_run(folder.path(), "2_approach", "FAIL", -3);
  make_run(folder.path(), "3_approach", "");
  write_file(make_run(folder.path(), "4_approach", "PASS") / "results.json", "{cut of");
  fs::create_directory(folder / "5_no_run");
  const auto runs = list_runs(folder.path());
  REQUIRE(runs.size() == 4);
  CHECK(runs[0].name() == "1_approach");
  CHECK(state_text(runs[0]) == "PASS");
  CHECK(runs[0].worst_criterion == "close");
  CHECK(runs[0].worst_margin == 5);
  CHECK(runs[0].duration_s == 12.5);
  CHECK(runs[0].procedure == "approach");
  CHECK(runs[1].worst_margin == -3);
  CHECK(state_text(runs[2]) == "UNFINISHED");
  CHECK(runs[2].reason.find("ended without a verdict") == 0);
  CHECK(state_text(runs[3]) == "UNFINISHED");
  CHECK(runs[3].reason == "results.json is damaged");
  CHECK(recorded_outcome(folder / "2_approach") == procedure_state_t::FAIL);
  CHECK_FALSE(recorded_outcome(folder / "3_approach"));
  CHECK_THROWS_AS(list_runs(folder / "nowhere"), InputError);

  const auto names = [](const std::vector<RunEntry>& found) {
    std::string text;
    for (const RunEntry& run : found) text += run.name().substr(0, 1);
    return text;
  };
  CHECK(names(matching(runs, {"", "fail", "", ""}, 0)) == "2");
  CHECK(names(matching(runs, {"", "unfinished", "", ""}, 0)) == "34");
  CHECK(names(matching(runs, {"appr", "", "twin", ""}, 2)) == "34");
  CHECK(names(matching(runs, {"hold", "", "", ""}, 0)).empty());
  CHECK(names(matching(runs, {"", "", "", "2026-11-23"}, 0)) == "34");
  CHECK_THROWS_AS(matching(runs, {"", "", "", "yesterday"}, 0), InputError);

  CHECK(find_run("last", folder.path()).filename() == "4_approach");
  CHECK(find_run("2_a", folder.path()).filename() == "2_approach");
  CHECK(find_run((folder / "1_approach").string(), folder.path()) == folder / "1_approach");
  CHECK_THROWS_AS(find_run("approach", folder.path()), InputError);
  CHECK_THROWS_AS(find_run("nothing", folder.path()), InputError);
}

TEST_CASE("a run is named by its directory, its log or a part of its name, for every command") {
  const TemporaryDirectory folder;
  const fs::path run = make_run(folder.path(), "1_approach", "PASS");
  fs::remove(run / "run.lcm");
  CHECK_THROWS_WITH(log_of_run("1_app", folder.path()),
                    Catch::Matchers::Contains("has no run.lcm"));
  write_file(run / "run.lcm", "");
  for (const std::string& name : {run.string(), std::string("1_app"), std::string("last")}) {
    CHECK(log_of_run(name, folder.path()) == run / "run.lcm");
    CHECK(directory_of_run(name, folder.path()) == run);
  }
  CHECK(log_of_run((run / "run.lcm").string()) == run / "run.lcm");
  CHECK(directory_of_run((run / "run.lcm").string()) == run);
  CHECK_THROWS_WITH(log_of_run("none", folder.path()),
                    Catch::Matchers::Contains("no such directory or log, and no run of that name"));
  CHECK_THROWS_WITH(directory_of_run(folder.path().string()),
                    Catch::Matchers::Contains("expected the directory of a run"));
}

TEST_CASE("an unreadable directory spoils neither the list of runs nor a run's outcome") {
  const TemporaryDirectory folder;
  setenv("XDG_RUNTIME_DIR", (folder / "runtime").c_str(), 1);
  make_run(folder.path(), "1_approach", "PASS");
  fs::create_symlink("loop", folder / "loop");  // as another user's folder: cannot be looked into
  REQUIRE(list_runs(folder.path()).size() == 1);
  CHECK(find_run("last", folder.path()).filename() == "1_approach");

  // No list of what runs, no folder for one.
  const char* given = getenv("TMPDIR");
  const std::string before = given == nullptr ? "/tmp" : given;
  unsetenv("XDG_RUNTIME_DIR");
  setenv("TMPDIR", (folder / "nowhere").c_str(), 1);
  CHECK(state_text(list_runs(folder.path()).front()) == "PASS");
  setenv("TMPDIR", before.c_str(), 1);
}

TEST_CASE("of several runs the worst counts, whichever came first") {
  const int by_severity[] = {exit_code::passed, exit_code::inconclusive, exit_code::failed,
                             exit_code::error, exit_code::aborted};
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j <= i; ++j) {
      CHECK(exit_code::worst(by_severity[i], by_severity[j]) == by_severity[i]);
      CHECK(exit_code::worst(by_severity[j], by_severity[i]) == by_severity[i]);
    }
  }
  CHECK(exit_code::worst(139, exit_code::failed) == 139);  // a process that died
}

TEST_CASE("whatever goes wrong in judging, a run has its verdict and its checksums") {
  const TemporaryDirectory folder;
  const RunFiles files = RunFiles::create(twin_of(folder.path()));
  const auto results = [&] {
    for (const char* file : {"verdict.txt", "results.json", "results.xml", "SHA256SUMS"}) {
      CHECK(fs::exists(files.directory / file));
    }
    CHECK(verify_checksums(files.directory).empty());
    return nlohmann::json::parse(read_file(files.directory / "results.json"));
  };
  SECTION("criteria that are not understood") {
    write_log(files, "criteria: [{name: odd, measurement: wobble, max: 1 mm}]\n");
    CHECK(write_verdict(files, exit_code::passed) == exit_code::inconclusive);
    CHECK(results()["outcome"] == "INCONCLUSIVE");
    CHECK(read_file(files.directory / "verdict.txt").find("wobble") != std::string::npos);
    CHECK(fs::exists(files.directory / "report.html"));
  }
  SECTION("a report that cannot be written") {
    write_log(files, "name: made\n");
    fs::create_directories(files.directory / "report.html" / "in the way");
    CHECK(write_verdict(files, exit_code::passed) == exit_code::passed);
    CHECK(results()["outcome"] == "PASS");
  }
  SECTION("no log, or none that is one") {
    if (GENERATE(false, true)) write_file(files.log(), "no log");
    CHECK(write_verdict(files, exit_code::passed) == exit_code::error);
    CHECK(results()["outcome"] == "ERROR");
  }
  SECTION("a host that failed, or was stopped, before the procedure spoke") {
    CHECK(write_verdict(files, exit_code::error, "no network") == exit_code::error);
    CHECK(results()["reason"] == "no network");
    CHECK(write_verdict(files, exit_code::aborted) == exit_code::aborted);
    CHECK(results()["outcome"] == "ABORTED");
  }
}
