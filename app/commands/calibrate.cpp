// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <memory>

#include "app/calibration/calibration_report.h"
#include "app/calibration/procedure_text.h"
#include "app/calibration/truth_check.h"
#include "app/commands/cell_options.h"
#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/choose_setup.h"
#include "app/runs/config_override.h"
#include "app/runs/run_list.h"
#include "app/terminal/progress_line.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "common/core/utc.h"
#include "procedures/check/rehearsal.h"
#include "testbed/calibration/calibration.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

/// m/s that the strokes reach at least.
constexpr double fast_speed = 0.2;

struct CalibrateOptions {
  CellOptions cell;
  int poses = 48;
  CalibrationPace pace;
  std::vector<fs::path> from;
  std::vector<fs::path> trackers;
  std::vector<fs::path> check;
  bool with_tracker = false;
  fs::path to;
  fs::path procedure;
  bool install = false;
};

/// The procedure that calibrates the requested cell, as text.
std::string choose(const CalibrateOptions& options) {
  const RunRequest& request = options.cell.request;
  RunSetup setup = choose_setup(
      {request.config, request.layout, request.target, request.target_length}, nullptr);
  const ChangedConfiguration changed(setup.config, request.parameters, setup.layout,
                                     request.calibration);
  setup.config = changed.directory();
  const procedures::Rig rig(setup);
  const auto prior = testbed::prior_covariance(
      rig.cell, testbed::load_calibration_settings(setup.config / "calibration.yaml").search);
  if ((prior.diagonal().array() <= 0).any()) {
    throw InputError("layout '" + setup.layout + "' has no real arms: nothing to calibrate");
  }
  testbed::SelectionOptions selection;
  selection.poses = options.poses;
  selection.limits = rig.settings.motion;
  selection.limits.speed = options.pace.speed;
  selection.limits.angular_speed = options.pace.turn;
  const testbed::CalibrationView view = testbed::calibration_view(rig.cell, rig.lidar);
  terminal::ProgressLine progress("choosing poses");
  const auto chosen =
      testbed::select_poses(rig.cell, rig.planner, view, prior, fast_speed, selection,
                            [&](int number) { progress.show((number - 1.0) / options.poses); });
  progress.status("");
  std::fprintf(
      stderr,
      "%zu poses and %zu fast strokes; truth should come out within %s mm and %s deg (rms)\n",
      chosen.poses.size(), chosen.strokes.size(), fixed(1e3 * chosen.expected_position, 2).c_str(),
      fixed(degrees(chosen.expected_rotation), 3).c_str());
  if (chosen.strokes.size() < 2) {
    std::fprintf(stderr, "berth: no stroke at %s mm/s for each arm: the clocks will not be known\n",
                 fixed(1e3 * fast_speed, 0).c_str());
  }
  const auto home = rig.home();
  RunSetup named = setup;
  named.target = request.target.empty() ? "" : setup.target;
  return calibration_procedure(named, chosen, rig.cell.relative_pose(home.replica, home.sensor),
                               view, options.pace);
}

int solve(const CalibrateOptions& options, const std::vector<fs::path>& directories) {
  std::vector<RunFiles> runs;
  std::vector<fs::path> trackers = options.trackers;
  for (const fs::path& name : directories) {
    const fs::path directory = directory_of_run(name.string());
    runs.push_back(RunFiles::open(directory));
    const fs::path tracker = directory / "tracker.csv";
    if (options.trackers.empty()) {
      trackers.push_back(options.with_tracker ? tracker : fs::path());
    }
  }
  if (trackers.size() != runs.size()) {
    throw InputError("--tracker: found " + std::to_string(trackers.size()) +
                     " files, expected one for each run");
  }
  const SolvedCalibration solved = solve_runs(runs, trackers, utc_text(std::time(nullptr)));
  const testbed::Calibration& calibration = solved.calibration;
  std::printf("%s", summary_of(solved).c_str());
  fs::path file = options.to;
  if (file.empty()) {
    file = options.cell.request.out /
           (calibration.layout + "_" + utc_stamp(calibration.made) + ".yaml");
  }
  testbed::write_calibration(calibration, file);
  const fs::path picture = fs::path(file).replace_extension(".svg");
  write_file(picture, residual_picture(solved));
  std::printf("\nwritten to %s, its residuals drawn in %s\n", file.c_str(), picture.c_str());
  if (!options.install) {
    std::printf("use it: berth run PROCEDURE --calibration %s\n", file.c_str());
    return exit_code::passed;
  }
  const fs::path config =
      choose_setup({options.cell.request.config, calibration.layout, "", 0}, nullptr).config;
  put_calibration(config, calibration.layout, file);
  std::printf("installed: %s has it from now on\n",
              (config / "calibration" / (calibration.layout + ".yaml")).c_str());
  return exit_code::passed;
}

int run_and_solve(CalibrateOptions& options) {
  complete(options.cell);
  RunRequest& request = options.cell.request;
  if (!request.joins.empty()) {
    throw InputError(
        "a cell is up: bring it down first (berth stop), or run the procedure of "
        "--procedure in it and solve with --from");
  }
  if (options.with_tracker && request.host != "cell") {
    request.parameters["simulation.yaml:tracker.write"] = "true";
  }
  const std::string text = choose(options);
  if (!options.procedure.empty()) {
    write_file(options.procedure, text);
    std::printf("written to %s; nothing was moved\n", options.procedure.c_str());
    return exit_code::passed;
  }
  fs::create_directories(request.out);
  request.procedure = request.out / "calibration.yaml";
  write_file(request.procedure, text);
  const RunFiles files = RunFiles::create(request);
  fs::remove(request.procedure);
  const int code = options.cell.twin ? run_in_twin(files) : run_in_processes(files, options.cell);
  if (code != exit_code::passed && code != exit_code::failed) return code;
  if (options.with_tracker && request.host == "cell") {
    std::printf("solve it with the tracker's file: berth calibrate --from %s --tracker FILE\n",
                files.directory.c_str());
    return exit_code::passed;
  }
  std::printf("\n");
  return solve(options, {files.directory});
}

int check(const CalibrateOptions& options) {
  Table table{
      "ll",
      {"run", "rests on", "samples", "median mm", "95 % mm", "median deg", "95 % deg", "time ms"}};
  for (const fs::path& run : options.check) {
    const TruthCheck c = check_truth(run);
    table.rows.push_back({run.filename().string(), c.basis, std::to_string(c.samples),
                          fixed(1e3 * c.median_position, 3), fixed(1e3 * c.worst_position, 3),
                          fixed(degrees(c.median_rotation), 4), fixed(degrees(c.worst_rotation), 4),
                          fixed(1e3 * c.time, 2)});
  }
  std::printf("ground truth against the simulated world, below 50 mm/s:\n%s",
              text_table(table).c_str());
  return exit_code::passed;
}

}  // namespace

void add_calibrate(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "calibrate",
      "Find out by how much the cell departs from its files: bases, mounts, joint zeros, links "
      "and\n"
      "clocks. Runs a procedure of poses chosen for their information, solves, and writes a dated\n"
      "calibration file with its covariance. See docs/calibration.md");
  auto options = std::make_shared<CalibrateOptions>();
  add_twin_options(*command, options->cell);
  add_cell_options(*command, options->cell);
  command->add_option("--poses", options->poses, "How many poses to measure at")
      ->capture_default_str();
  command->add_option("--estimates", options->pace.estimates, "How many estimates at each pose")
      ->capture_default_str();
  command->add_option("--returns", options->pace.returns, "Beams of one scan")
      ->capture_default_str();
  command->add_option("--strokes", options->pace.strokes, "Fast strokes with each arm")
      ->capture_default_str();
  command->add_option("--procedure", options->procedure,
                      "Only choose the poses and write the procedure to this file");
  command->add_option("--from", options->from,
                      "Move nothing: solve from these recorded runs, whatever they were");
  command->add_flag(
      "--with-tracker", options->with_tracker,
      "A laser tracker watches; a simulated one writes tracker.csv in the run directory");
  command->add_option("--tracker", options->trackers,
                      "With --from: the tracker's CSV of each run (time, point, x, y, z)");
  command->add_option("--check", options->check,
                      "Only report how far the ground truth of simulated runs is from their world");
  command->add_option("--to", options->to, "The calibration file; OUT/LAYOUT_DATE.yaml without");
  command->add_flag("--install", options->install,
                    "Make it the configuration's own calibration of the layout");
  command->callback([options, &exit_code] {
    if (!options->check.empty()) {
      exit_code = check(*options);
    } else if (!options->from.empty()) {
      exit_code = solve(*options, options->from);
    } else {
      exit_code = run_and_solve(*options);
    }
  });
}

}  // namespace berth::commands
