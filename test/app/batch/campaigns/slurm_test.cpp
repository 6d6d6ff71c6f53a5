// SPDX-License-Identifier: BSD-3-Clause
// What is handed to Slurm. The scheduler itself: part `campaign` of the nightly target.
#include "app/batch/campaigns/slurm.h"

#include <numeric>

#include "common/core/child_process.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "test/app/batch/campaigns/made_campaign.h"
#include "test/catch.h"

namespace berth::campaigns {
namespace {

namespace fs = std::filesystem;

std::vector<Block> blocks_of(std::int64_t count, std::int64_t size) {
  std::vector<Block> blocks;
  for (std::int64_t i = 0; i < count; ++i) blocks.push_back({i * size, (i + 1) * size});
  return blocks;
}

struct Directory {
  fs::path path = fs::temp_directory_path() / ("berth slurm's " + std::to_string(getpid()));
  Directory() { fs::remove_all(path); }
  ~Directory() { fs::remove_all(path); }
};

SlurmOptions options_of(const fs::path& directory, const std::string& text) {
  fs::create_directories(directory);
  const fs::path file = directory / "slurm.yaml";
  write_file(file, text);
  return load_slurm_options(file);
}

TEST_CASE("each missing block is in one task, and tasks have the requested length") {
  const auto all = blocks_of(100, 10);
  Random random(1, "missing");
  for (const double share : {1.0, 0.5, 0.02}) {
    std::vector<Block> missing;
    for (const Block& block : all) {
      if (random.uniform() < share) missing.push_back(block);
    }
    const auto tasks = tasks_of(all, missing, 45);
    std::vector<int> times(all.size());
    std::int64_t before = 0;
    std::int64_t trials = 0;
    for (const SlurmTask& task : tasks) {
      CHECK(task.first >= before);  // no two do the same
      before = task.first + task.count;
      for (std::int64_t i = task.first; i < before; ++i) ++times[static_cast<std::size_t>(i)];
      trials += task.trials;
      if (&task != &tasks.back()) CHECK((task.trials >= 45 && task.trials < 55));
    }
    CHECK(trials == 10 * std::ssize(missing));
    for (const Block& block : missing)
      CHECK(times[static_cast<std::size_t>(block.begin / 10)] == 1);
  }
  CHECK(tasks_of(all, {}, 45).empty());
}

TEST_CASE("the length of a task follows from the time of a trial, within what an array may hold") {
  SlurmOptions options;
  CHECK(trials_of_a_task(options, 0.01, 1000000, 1000) == 12000);  // 120 s
  CHECK(trials_of_a_task(options, 0.01, 500, 1000) == 500);
  CHECK(trials_of_a_task(options, 0.01, 100000000, 1000) == 100000);
  options.cpus = 4;
  CHECK(trials_of_a_task(options, 0.01, 1000000, 1000) == 48000);
  options.task_trials = 20;
  CHECK(trials_of_a_task(options, 0.01, 1000, 1000) == 20);
}

TEST_CASE("options of a cluster are read strictly") {
  const Directory directory;
  const auto options = options_of(directory.path,
                                  "partition: long\ntime: 90 s\nmemory: 2G\ncpus: 2\n"
                                  "at_a_time: 7\narguments: [--account=lab]\n");
  const auto campaign = Campaign::create(made_manifest(10), directory.path / "one", 0);
  const SlurmFolder folder{campaign.directory() / "slurm" / "1"};
  CHECK(array_command(campaign, folder, options, 12) ==
        std::vector<std::string>{"sbatch", "--parsable", "--job-name=berth-made-up",
                                 "--chdir=" + campaign.directory().string(), "--partition=long",
                                 "--mem=2G", "--time=2", "--array=0-11%7", "--ntasks=1",
                                 "--cpus-per-task=2",
                                 "--output=" + folder.path.string() + "/task-%a.log",
                                 "--account=lab", folder.path.string() + "/task.sh"});
  const auto merge = merge_command(campaign, folder, options, "42");
  CHECK(std::count(merge.begin(), merge.end(), "--dependency=afterany:42") == 1);
  CHECK(std::count(merge.begin(), merge.end(), "--account=lab") == 1);
  CHECK_THROWS_WITH(options_of(directory.path, "queue: long\n"),
                    Catch::Matchers::Contains("slurm.yaml:1: key 'queue'"));
  CHECK_THROWS_AS(options_of(directory.path, "cpus: 0\n"), InputError);
}

TEST_CASE("a task's script runs its line's blocks and leaves its exit code, whatever the path") {
  const Directory directory;
  const auto campaign = Campaign::create(made_manifest(10), directory.path / "one", 0);
  const SlurmFolder folder{campaign.directory() / "slurm" / "1"};
  fs::create_directories(folder.path);
  write_file(folder.tasks(), text_of({{0, 3, 30}, {5, 1, 10}}));
  // Stands in for berth: prints its arguments and fails.
  const fs::path program = directory.path / "it's berth";
  write_file(program, "#!/bin/sh\nfor word in \"$@\"; do echo \"<$word>\"; done\nexit 7\n");
  fs::permissions(program, fs::perms::owner_all);
  SlurmOptions options;
  options.before = "echo loaded";
  write_file(folder.script(), task_script(campaign, folder, options, program));
  const auto output = run_program({"env", "SLURM_ARRAY_TASK_ID=1", "sh", folder.script().string()});
  CHECK(output.end.code() == 7);
  CHECK(output.text.find("loaded\n") == 0);
  CHECK(output.text.find("<campaign>\n<block>\n<" + campaign.directory().string() +
                         ">\n<5>\n<--count>\n<1>\n<--jobs>\n<1>\n") != std::string::npos);
  CHECK(read_file(folder.exit_file(1)) == "7\n");
}

TEST_CASE("a program's output, both streams, its exit code and its absence") {
  const auto output = run_program({"sh", "-c", "echo out; echo err >&2; exit 3"});
  CHECK(output.text == "out\n");
  CHECK(output.errors == "err\n");
  CHECK(output.end.code() == 3);
  const ProcessEnd killed = run_program({"sh", "-c", "kill -9 $$"}).end;
  CHECK(killed.code() == 137);
  CHECK(killed.text() == "died of SIGKILL (Killed)");
  const auto long_one = run_program({"sh", "-c", "head -c 300000 /dev/zero >&2; echo end"});
  CHECK(long_one.errors.size() == 300000);
  CHECK(long_one.text == "end\n");
  CHECK_THROWS_WITH(run_program({"no-such-program"}),
                    Catch::Matchers::Contains("no-such-program: cannot be started"));
}

}  // namespace
}  // namespace berth::campaigns
