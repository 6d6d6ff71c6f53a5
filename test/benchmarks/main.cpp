// SPDX-License-Identifier: BSD-3-Clause
// Runs the benchmarks: every target as a table, the paper's figures as pictures and CSV.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "common/core/error.h"
#include "test/benchmarks/settings.h"

namespace {

using namespace berth;
using namespace berth::benchmark;

struct Part {
  const char* name;
  int (*run)(const Settings&);
};

constexpr Part parts[] = {
    {"acquisition", run_acquisition},
    {"tracking", run_tracking},
    {"basin", run_basin},
    {"speed", run_speed},
    {"motion", run_motion},
    {"planning", run_planning},
    {"scaling", run_scaling},
    {"paper-acquisition", run_paper_acquisition},
    {"paper-strategies", run_paper_strategies},
    {"paper-tracking", run_paper_tracking},
    {"micro", run_micro},
    {"real", run_real},
    {"departures", run_departures},
};

void require_known(const std::vector<std::string>& names, const std::vector<std::string>& known) {
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    std::string all;
    for (const std::string& k : known) all += " " + k;
    throw InputError("method '" + name + "' is not known, expected one of:" + all);
  }
}

int run(int argc, char* argv[]) {
  Settings settings;
  std::vector<std::string> selected;
  std::string names;
  for (const Part& part : parts) names += std::string(names.empty() ? "" : " ") + part.name;
  const char* home = std::getenv("BERTH_HOME");
  const std::filesystem::path root = home == nullptr ? "." : home;
  settings.out = root / "build" / "benchmark" / "results";
  const char* meshes = std::getenv("BERTH_TARGETS");
  if (meshes != nullptr) settings.meshes = meshes;
  std::filesystem::path config = root / "config" / "estimator.yaml";

  CLI::App app(
      "Measures the estimator against its targets and redraws the paper's figures.\n"
      "Exit codes: 0 every target met, 1 some missed, 2 the input was at fault.",
      "berth benchmark");
  app.add_option("PART", selected, "of: " + names + "; all when none is named");
  app.add_option("--trials", settings.trials,
                 "of each row (of departures: fewer where scans are dense)")
      ->check(CLI::Range(2, 1000000));
  app.add_option("--seed", settings.seed, "another one makes fresh trials");
  app.add_option("--jobs", settings.jobs, "threads, for parts that do not measure time")
      ->check(CLI::Range(1, 64));
  app.add_option("--out", settings.out, "directory of tables and pictures");
  app.add_option("--meshes", settings.meshes,
                 "directory of meshes to acquire beside the replica (or BERTH_TARGETS)");
  app.add_option("--targets", settings.targets,
                 "of departures: names, meshes, or files of the directory of meshes")
      ->delimiter(',');
  app.add_option("--stated-sigma", settings.stated_sigma,
                 "of departures: times the surface's true sigma, what described targets are told")
      ->check(CLI::Range(0.01, 100.0));
  app.add_option("--config", config, "the methods' settings");
  app.add_option("--acquisition", settings.acquisition_methods,
                 "methods, by name; of departures also 'none': tracking alone")
      ->delimiter(',');
  app.add_option("--tracking", settings.tracking_methods,
                 "methods, by name; of departures also 'none': acquisition alone")
      ->delimiter(',');
  bool check = false;
  app.add_flag("--check", check,
               "for few trials: missed is what their 95 % intervals exclude; time counts beside "
               "PCL's only");
  app.add_option("--only", settings.only,
                 "rows whose name holds one of these, as 'Error1 sparse 200 '")
      ->delimiter(',');
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  settings.yardstick = Yardstick(!check);
  settings.trials_given = app.count("--trials") > 0;
  settings.untimed_jobs = app.count("--jobs") > 0
                              ? settings.jobs
                              : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  settings.config = config.parent_path();
  settings.options = estimator::load_estimator_options(config);
  if (settings.acquisition_methods.empty()) {
    settings.acquisition_methods = {settings.options.acquisition_method};
  }
  if (settings.tracking_methods.empty()) {
    settings.tracking_methods = {settings.options.tracking_method};
  }
  std::vector<std::string> acquisition_names = estimator::acquisition_names();
  std::vector<std::string> tracking_names = estimator::tracking_names();
  if (selected == std::vector<std::string>{"departures"}) {
    acquisition_names.push_back(no_method);
    tracking_names.push_back(no_method);
  }
  require_known(settings.acquisition_methods, acquisition_names);
  require_known(settings.tracking_methods, tracking_names);
  std::filesystem::create_directories(settings.out);
  for (const std::string& name : selected) {
    const auto known = [&name](const Part& part) { return name == part.name; };
    if (std::none_of(std::begin(parts), std::end(parts), known)) {
      throw InputError("part '" + name + "' is not known, expected one of: " + names);
    }
  }
  int missed = 0;
  for (const Part& part : parts) {
    if (!selected.empty() &&
        std::find(selected.begin(), selected.end(), part.name) == selected.end()) {
      continue;
    }
    missed += part.run(settings);
  }
  std::printf("\n%s\ntables and pictures: %s\n",
              missed == 0 ? "no target missed" : (std::to_string(missed) + " missed").c_str(),
              settings.out.c_str());
  return missed == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char* argv[]) {
  try {
    return run(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "berth benchmark: %s\n", e.what());
    return 2;
  }
}
