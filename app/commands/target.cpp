// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/run_files.h"
#include "app/runs/run_list.h"
#include "app/targets/new_target.h"
#include "app/targets/target_report.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/lidar_profile.h"
#include "common/core/shared_files.h"
#include "common/core/table.h"
#include "common/core/text.h"
#include "drivers/devices.h"
#include "evaluation/targets/run_returns.h"
#include "evaluation/targets/write_measured.h"

namespace berth::commands {
namespace {

namespace fs = std::filesystem;

struct TargetOptions {
  std::string target;
  fs::path mesh;
  std::string name;
  double length = 0;
  fs::path out;
  std::vector<std::string> runs;
  double full_scale_range = 0;
  bool write = false;
};

int make(const TargetOptions& options) {
  const std::string name = options.name.empty() ? options.mesh.stem().string() : options.name;
  const bool is_folder = fs::path(name) != fs::path(name).filename();
  const fs::path folder = is_folder ? fs::path(name) : shared_files() / "targets" / name;
  make_target(options.mesh, folder, options.length);
  std::printf("%s\n", (folder / target_file).c_str());
  return exit_code::passed;
}

int check(const TargetOptions& options) {
  const Target target = load_target(options.target, 0);
  std::fputs(report_of(target).c_str(), stdout);
  for (const std::string& text : validation_notes(target))
    std::printf("\nnote: %s\n", text.c_str());
  return exit_code::passed;
}

int picture(const TargetOptions& options) {
  const Target target = load_target(options.target, 0);
  const fs::path out = options.out.empty() ? fs::path(target.name + ".svg") : options.out;
  write_file(out, draw(target));
  std::printf("%s\n", out.c_str());
  return exit_code::passed;
}

std::string shown_measured(const std::optional<targets::Measured>& measured, double factor,
                           int decimals) {
  if (!measured) return "-";
  return fixed(factor * measured->value, decimals) + " +- " +
         fixed(factor * measured->sigma, decimals);
}

int measure(const TargetOptions& options) {
  const Target target = load_target(options.target, 0);
  targets::MeasurementSettings settings;
  std::vector<targets::TrueReturn> returns;
  std::size_t run_count = 0;
  double reach = 0;
  for (const Vector3d& vertex : target.mesh.vertices) reach = std::max(reach, vertex.norm());
  reach *= 1.2;  // a surface departs, and parts turn
  for (const std::string& run : options.runs) {
    const RunFiles files = RunFiles::open(directory_of_run(run));
    settings.beam =
        load_lidar_profile(files.setup, load_devices(files.setup.config).lidar.model).beam;
    // This key alone: runs of before may have others under former names.
    Config::load(files.setup.config / "simulation_lidar.yaml")
        .optional("full_scale_range", Dimension::length, settings.full_scale_range);
    targets::RunReturns read = targets::read_returns(files.log(), reach);
    if (read.target_hash != target.hash) {
      throw InputError(run + ": was flown with another mesh than that of target '" + target.name +
                       "' at " + shown(target.length) + " m");
    }
    for (targets::TrueReturn& seen : read.returns) seen.run = run_count;
    if (!read.returns.empty()) ++run_count;
    returns.insert(returns.end(), read.returns.begin(), read.returns.end());
  }
  if (options.full_scale_range > 0) settings.full_scale_range = options.full_scale_range;
  const auto parts = targets::measure_parts(target, returns, settings);
  Table table{"l",
              {"part", "returns", "surface sigma, mm", "alike over, mm", "reflectivity",
               "joint angle, deg"}};
  for (const targets::PartMeasurement& part : parts) {
    table.rows.push_back(
        {part.part, std::to_string(part.returns), shown_measured(part.surface_sigma, 1e3, 2),
         shown_measured(part.correlation_length, 1e3, 0), shown_measured(part.reflectivity, 1, 4),
         shown_measured(part.joint_angle, degrees(1), 2)});
  }
  std::fputs(text_table(table).c_str(), stdout);
  for (const targets::PartMeasurement& part : parts) {
    if (!part.note.empty()) std::printf("note: %s: %s\n", part.part.c_str(), part.note.c_str());
  }
  if (!options.write) return exit_code::passed;
  const fs::path folder = find_target(options.target);
  if (!fs::is_directory(folder)) {
    throw InputError("target '" + options.target +
                     "' is a bare mesh: `berth target new` makes a folder that values fit into");
  }
  const fs::path file = folder / target_file;
  write_file(file, targets::with_measured(read_file(file), file.string(), parts));
  std::printf("written to %s\n", file.c_str());
  return exit_code::passed;
}

}  // namespace

void add_target(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("target", "Describe, check, draw and measure a target");
  command->require_subcommand(1);
  auto options = std::make_shared<TargetOptions>();
  const auto add = [&](const char* name, const char* what, int (*run)(const TargetOptions&)) {
    auto* verb = command->add_subcommand(name, what);
    verb->callback([options, run, &exit_code] { exit_code = run(*options); });
    return verb;
  };
  const auto named = [&](CLI::App* verb) {
    verb->add_option("target", options->target, "Name of targets/, a folder, or a mesh")
        ->required();
    return verb;
  };
  auto* fresh = add("new", "Make a folder that describes a mesh, to be filled in", make);
  fresh->add_option("mesh", options->mesh, "PLY, STL or OBJ")->required()->check(CLI::ExistingFile);
  fresh->add_option("--name", options->name,
                    "Of the target, or a folder; the mesh's own when left out");
  fresh->add_option("--length", options->length,
                    "Largest side as held, m; the mesh's when left out");
  named(add("check", "Read a target strictly, and report what may be wrong with it", check));
  auto* picture_verb = named(add("draw", "Draw a target from six sides, as SVG", picture));
  picture_verb->add_option("--out", options->out, "Picture to write; NAME.svg when left out");
  auto* measure_verb = named(
      add("measure", "Find each part's surface, reflectivity and joint angle from runs", measure));
  measure_verb->add_option("runs", options->runs, "Run directories, names of runs, or 'last'")
      ->required();
  measure_verb->add_option("--full-scale-range", options->full_scale_range,
                           "m, at which a white surface returns full intensity; the simulated "
                           "LIDAR's when left out");
  measure_verb->add_flag("--write", options->write, "Put the values into target.yaml");
}

}  // namespace berth::commands
