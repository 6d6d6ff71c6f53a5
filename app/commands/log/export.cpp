// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cinttypes>
#include <cstdio>

#include "app/commands/log/verbs.h"
#include "app/exit_code.h"
#include "common/core/error.h"
#include "common/core/valid_text.h"
#include "evaluation/run/truth_track.h"
#include "logs/export/cloud_files.h"
#include "logs/export/csv.h"
#include "logs/export/mcap.h"
#include "logs/inspect/channel_pattern.h"

namespace berth::commands::log {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  fs::path csv;
  fs::path clouds;
  fs::path mcap;
  std::string format = "pcd";
  std::string frame = "sensor";
  std::string by;
  bool merge = false;
  std::string channels;
};

/// @return the exit code
int export_csv(const fs::path& log, const ExportOptions& options,
               const logs::TypeCatalogue& types) {
  const logs::ChannelPattern channels(options.channels);
  std::vector<std::string> left_out;
  const auto files = logs::export_csv(
      log, options.csv, types, [&](std::string_view c) { return channels.matches(c); }, left_out);
  int code = exit_code::passed;
  for (const logs::CsvFile& file : files) {
    if (!file.failure.empty()) {
      print_text("berth: channel '" + terminal_line(file.channel) +
                     "' is not exported: " + file.failure + "\n",
                 stderr);
      code = exit_code::error;
      continue;
    }
    const bool renamed = file.path.stem() != file.channel;
    print_text(file.path.string() + (renamed ? " (" + terminal_line(file.channel) + ")" : "") +
               ": " + std::to_string(file.rows) + " rows\n");
    if (file.undecodable > 0) {
      print_text("berth: " + terminal_line(file.channel) + ": " + std::to_string(file.undecodable) +
                     " undecodable messages have no row\n",
                 stderr);
    }
  }
  for (const std::string& channel : left_out) {
    print_text("berth: " + terminal_line(channel) +
                   ": of unknown type, left out; give its .lcm file with --types\n",
               stderr);
  }
  return code;
}

int export_clouds(const fs::path& log, const ExportOptions& options) {
  logs::CloudOptions clouds;
  clouds.format = options.format == "ply" ? logs::CloudFormat::ply : logs::CloudFormat::pcd;
  clouds.merge = options.merge;
  if (options.frame == "model") {
    const auto by =
        options.by == "truth" ? evaluation::PoseSource::truth : evaluation::PoseSource::estimate;
    clouds.model_pose = [poses = evaluation::TargetPoses(log, by)](const logs::ScanCloud& scan,
                                                                   Utime utime) {
      return poses.at(scan.session, scan.scan_id, utime);
    };
  }
  const auto result = logs::export_clouds(log, options.clouds, clouds);
  std::printf("%s: %" PRId64 " scans, %" PRId64 " points; %" PRId64
              " scans without a return have no file\n",
              options.clouds.c_str(), result.scans, result.points, result.without_return);
  if (result.without_pose > 0) {
    std::fprintf(stderr, "berth: %" PRId64 " returns are left out: no %s of their time\n",
                 result.without_pose, options.by.c_str());
  }
  if (result.packets_missing + result.undecodable > 0) {
    std::fprintf(stderr,
                 "berth: %" PRId64 " packets of scans are missing, %" PRId64 " do not decode\n",
                 result.packets_missing, result.undecodable);
  }
  if (result.failed == 0) return exit_code::passed;
  print_text("berth: " + std::to_string(result.failed) +
                 " scans are not exported; the first of them: " + result.failure + "\n",
             stderr);
  return exit_code::error;
}

void export_mcap(const fs::path& log, const ExportOptions& options,
                 const logs::TypeCatalogue& types) {
  const logs::ChannelPattern channels(options.channels);
  const auto result = logs::export_mcap(log, options.mcap, types,
                                        [&](std::string_view c) { return channels.matches(c); });
  std::printf("%s: %" PRIu64 " messages of %" PRId64 " topics\n", options.mcap.c_str(),
              result.messages, result.channels);
  if (result.undecodable + result.unknown > 0) {
    std::fprintf(stderr,
                 "berth: left out: %" PRId64 " undecodable messages, %" PRId64
                 " of unknown type (give the .lcm files with --types)\n",
                 result.undecodable, result.unknown);
  }
}

int run(const fs::path& log, const ExportOptions& options, const Paths& given) {
  if (options.csv.empty() && options.clouds.empty() && options.mcap.empty()) {
    throw InputError("export: expected --csv, --clouds or --mcap");
  }
  if ((options.frame == "model") != !options.by.empty()) {
    throw InputError(
        "export: --frame model and --by belong together: truth or estimate gives the pose "
        "of the model");
  }
  if (options.merge && options.frame != "model") {
    throw InputError("export: --merge: expected --frame model: the sensor moved between scans");
  }
  const logs::TypeCatalogue types = types_of({log}, given);
  int code = exit_code::passed;
  if (!options.csv.empty()) code = std::max(code, export_csv(log, options, types));
  if (!options.clouds.empty()) code = std::max(code, export_clouds(log, options));
  if (!options.mcap.empty()) export_mcap(log, options, types);
  return code;
}

}  // namespace

void add_export(CLI::App& log, int& exit_code) {
  auto* command = log.add_subcommand(
      "export", "Write a log for other programs: tables, point clouds, MCAP. Never overwrites");
  auto file = add_log_argument(*command);
  auto options = std::make_shared<ExportOptions>();
  command->add_option("--csv", options->csv,
                      "Directory: a CSV file for each channel, units in the header");
  command->add_option("--clouds", options->clouds,
                      "Directory: a file for each scan, with intensity and time");
  command->add_option("--format", options->format, "Of the clouds: pcd or ply")
      ->check(CLI::IsMember({"pcd", "ply"}))
      ->capture_default_str();
  command->add_option("--frame", options->frame, "Of the clouds: the sensor's or the model's")
      ->check(CLI::IsMember({"sensor", "model"}))
      ->capture_default_str();
  command
      ->add_option("--by", options->by,
                   "Where the model was at the time of each return: by truth or by estimate")
      ->check(CLI::IsMember({"truth", "estimate"}));
  command->add_flag("--merge", options->merge, "All scans of a session in one cloud");
  command->add_option("--mcap", options->mcap,
                      "File for Foxglove-compatible viewers and PlotJuggler");
  command->add_option("--channels", options->channels,
                      "Only these channels (regular expression) into CSV and MCAP");
  auto types = add_types_option(*command);
  command->callback([=, &exit_code] { exit_code = run(log_of_run(*file), *options, *types); });
}

}  // namespace berth::commands::log
