// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <new>
#include <optional>

#include "app/commands/cell_options.h"
#include "app/commands/commands.h"
#include "app/commands/estimate_hints.h"
#include "app/commands/estimate_report.h"
#include "app/exit_code.h"
#include "app/runs/run_files.h"
#include "common/core/error.h"
#include "common/core/lidar_profile.h"
#include "common/core/quantity.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"
#include "estimator/model/model_file.h"

namespace berth::commands {
namespace {

using namespace estimator;

constexpr const char* explanation =
    "\n"
    "Clouds are in the sensor's frame (x right, y down, z along the boresight, or as the sensor "
    "has\n"
    "it), in metres or in the unit that a column's name gives. PCD and PLY: fields x y z. XYZ, "
    "TXT, "
    "CSV,\n"
    "ASC, PTS: text, x y z first, or a line that names the columns. PTX: one scan; its empty beams "
    "count\n"
    "as misses. A time and sigma (of the range) are used where there are any: docs/clouds.md.\n"
    "A file is read whole or refused, and never stops the others.\n"
    "\n"
    "One JSON object a cloud goes to stdout, in the order of the clouds; what is not known is "
    "null:\n"
    "  status          ok, ambiguous (see hypotheses), lost, or error (a bad file), with a reason\n"
    "  T_sensor_model  4x4, maps model to sensor coordinates, m; the most probable when ambiguous\n"
    "  xyzwpr          the same in mm and degrees, R = Rz(r) Ry(p) Rx(w)\n"
    "  covariance      6x6 of [translation (m); rotation vector (rad)], a perturbation in the\n"
    "                  sensor's frame: t + d[0..2], Exp(d[3..5]) R\n"
    "  hypotheses      every pose that may be, with its probability\n"
    "  equal_poses     how many poses the target's own symmetry makes one and the same\n"
    "  log_likelihood, counts (of points), times_ms, methods, notes\n"
    "\n"
    "Exit code, the first that holds: 2 a file or option was at fault, 1 the target was lost in a\n"
    "cloud, 4 a cloud was ambiguous, 0 all poses are ok.";

struct EstimateOptions {
  std::string target;
  double length = 0;
  std::vector<double> initial;
  std::vector<double> gate;
  std::string noise;
  std::string time_unit;
  std::filesystem::path config;
  int indent = -1;
  std::vector<std::string> clouds;
};

std::int64_t stopwatch() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// The model from the cache; prints a note when it must be compiled first.
std::shared_ptr<const TargetModel> prepare_model(const Target& target,
                                                 const ModelOptions& options) {
  const std::filesystem::path cache = default_cache_directory();
  std::error_code ignored;
  if (std::filesystem::exists(cache / ModelFile::name(target, options), ignored)) {
    return load_target_model(target, options, cache);
  }
  std::fprintf(stderr, "berth: compiling %s, %zu triangles (once: kept in %s)\n",
               target.name.c_str(), target.mesh.triangles.size(), cache.c_str());
  const std::int64_t start = stopwatch();
  auto model = load_target_model(target, options, cache);
  std::fprintf(stderr, "berth: compiled in %s s\n",
               fixed(1e-6 * static_cast<double>(stopwatch() - start), 1).c_str());
  return model;
}

int code_of(SingleScanResult::Status status) {
  switch (status) {
    case SingleScanResult::Status::ok:
      return exit_code::passed;
    case SingleScanResult::Status::ambiguous:
      return exit_code::inconclusive;
    default:
      return exit_code::failed;
  }
}

std::vector<RawBeam> raw_beams(const clouds::Cloud& cloud) {
  std::vector<RawBeam> beams;
  beams.reserve(cloud.beams.size());
  for (const clouds::CloudBeam& beam : cloud.beams) {
    beams.push_back({beam.utime, beam.range, beam.azimuth, beam.elevation,
                     beam.hit ? BeamStatus::hit : BeamStatus::miss, beam.range_sigma});
  }
  return beams;
}

/// "5 mm,0.1 mrad"; bare numbers are in m and rad.
void take_noise(const std::string& text, BeamModel& beam_model) {
  const auto quantity = [](std::string word, const std::string& unit, Dimension dimension) {
    const auto last = word.find_last_not_of(' ');
    const bool bare =
        last != std::string::npos &&
        (std::isdigit(static_cast<unsigned char>(word[last])) != 0 || word[last] == '.');
    const double value = parse_quantity(bare ? word + " " + unit : word, dimension);
    if (!(value > 0)) throw InputError("found '" + word + "', expected more than 0");
    return value;
  };
  const auto comma = text.find(',');
  try {
    beam_model.range_sigma_m = quantity(text.substr(0, comma), "m", Dimension::length);
    if (comma == std::string::npos) return;
    beam_model.azimuth_sigma_rad = beam_model.elevation_sigma_rad =
        quantity(text.substr(comma + 1), "rad", Dimension::angle);
  } catch (const InputError& e) {
    throw InputError(std::string("--noise: ") + e.what());
  }
}

std::string noise_note(const BeamModel& noise, const std::string& lidar) {
  return "the beams' noise is taken to be that of " + lidar + ", " +
         shown(1e3 * noise.range_sigma_m) + " mm and " + shown(1e3 * noise.azimuth_sigma_rad) +
         " mrad; --noise overrides it";
}

int estimate(const EstimateOptions& options) {
  const std::filesystem::path config =
      options.config.empty() ? shared_files() / "config" : options.config;
  const bool is_directory = std::filesystem::is_directory(config);
  const EstimatorOptions settings =
      load_estimator_options(is_directory ? config / "estimator.yaml" : config);
  const std::filesystem::path directory = is_directory ? config : config.parent_path();
  BeamModel beam_model = without_range_limits(
      load_lidar_profile(directory / "lidars" / (settings.lidar + ".yaml")).beam);
  if (!options.noise.empty()) take_noise(options.noise, beam_model);
  clouds::CloudOptions reading;
  if (!options.time_unit.empty()) {
    reading.us_per_time = 1e6 * find_unit(options.time_unit, Dimension::time).value();
  }
  RangeGate gate;
  if (!options.gate.empty()) gate = {options.gate[0], options.gate[1]};
  if (!(gate.near >= 0 && gate.far > gate.near)) {
    throw InputError("--gate: found a gate that holds nothing, expected FAR > NEAR >= 0");
  }
  std::optional<Pose> initial;
  if (!options.initial.empty()) {
    Xyzwpr xyzwpr{};
    std::copy(options.initial.begin(), options.initial.end(), xyzwpr.begin());
    if (!std::all_of(xyzwpr.begin(), xyzwpr.end(), [](double v) { return std::isfinite(v); })) {
      throw InputError("--initial: found a value that is not finite, expected six numbers");
    }
    initial = pose_from_xyzwpr(xyzwpr);
  }
  const Target wished = load_target(options.target, options.length);
  const std::vector<std::string> notes = target_notes(wished);
  print_notes(notes, options.target);
  const double length = wished.length;
  const auto model = prepare_model(load_target(options.target, reference_length_m), settings.model);
  const SingleScan method(*model, length / reference_length_m, settings, beam_model, stopwatch);

  int code = exit_code::passed;
  for (const std::string& file : options.clouds) {
    nlohmann::ordered_json report;
    try {
      const std::int64_t start = stopwatch();
      const clouds::Cloud cloud = clouds::read_cloud(file, reading);
      const PreprocessedScan scan = preprocess(raw_beams(cloud), gate, beam_model);
      const std::int64_t read_us = stopwatch() - start;
      SingleScanResult result = method.estimate(scan, initial);
      add_hints(cloud, scan, length, result);
      if (options.noise.empty()) result.notes.push_back(noise_note(beam_model, settings.lidar));
      for (const std::string& note : notes) result.notes.push_back("target: " + note);
      report = report_of(file, cloud, scan, method, result, read_us);
      code = exit_code::worst(code, code_of(result.status));
    } catch (const InputError& e) {
      report = error_report(file, e.what());
    } catch (const std::bad_alloc&) {
      report = error_report(file, file + ": this machine's memory does not hold it");
    } catch (const std::exception& e) {  // whatever it is, the others go on
      report = error_report(file, file + ": " + e.what());
    }
    if (report["status"] == "error") {
      print_text("berth: " + report["reason"].get_ref<const std::string&>() + "\n", stderr);
      code = exit_code::worst(code, exit_code::error);
    }
    std::puts(json_text(report, options.indent).c_str());
    std::fflush(stdout);
  }
  return code;
}

}  // namespace

void add_estimate(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand(
      "estimate", "Estimate the pose of a target in point clouds of your own, as JSON");
  command->footer(explanation);
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("cloud", options->clouds, "Cloud files")->required();
  command
      ->add_option("--target", options->target,
                   "PLY, STL or OBJ mesh, a name of targets/, or a folder with a target.yaml")
      ->required();
  command
      ->add_option("--length", options->length,
                   "Scale the mesh about its origin so that its bounding box's largest side is so "
                   "many metres")
      ->check(CLI::Validator(
          [](const std::string& text) {
            double length = 0;
            const bool fine =
                CLI::detail::lexical_cast(text, length) && length > 0 && std::isfinite(length);
            return fine ? std::string() : "found '" + text + "', expected a length above 0";
          },
          "METRES"));
  command
      ->add_option("--initial", options->initial,
                   "Pose (mm, degrees) to start from; acquired anew where it fails")
      ->delimiter(',')
      ->expected(6)
      ->option_text("X,Y,Z,W,P,R");
  command
      ->add_option("--gate", options->gate,
                   "The target is between these ranges, m (any range when left out)")
      ->delimiter(',')
      ->expected(2)
      ->option_text("NEAR,FAR");
  command
      ->add_option("--noise", options->noise,
                   "Standard deviation RANGE[,ANGLE] of the beams, as '5 mm,0.1 mrad' (m and rad "
                   "without units); returns that bring a sigma of their own keep it. That of the "
                   "LIDAR in --config when left out")
      ->type_name("RANGE[,ANGLE]");
  command
      ->add_option("--time-unit", options->time_unit,
                   "Unit of the clouds' times where their names and values do not determine it")
      ->check(CLI::IsMember({"s", "ms", "us", "ns"}));
  command
      ->add_option("--config", options->config,
                   "Configuration directory or its estimator.yaml, for methods and beam noise (the "
                   "methods hypotheses and likelihood, and the ILRIS-3D's noise, when left out)")
      ->check(CLI::ExistingPath);
  command->add_option("--json-indent", options->indent, "Spread the JSON over lines, so indented")
      ->check(CLI::Range(0, 16));
  command->callback([options, &exit_code] { exit_code = estimate(*options); });
}

}  // namespace berth::commands
