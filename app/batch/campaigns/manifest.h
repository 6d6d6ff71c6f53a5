// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "app/batch/campaigns/parameter.h"
#include "evaluation/measure/measurement.h"

namespace berth::campaigns {

/// A number that is kept of every trial.
struct KeptMeasurement {
  std::string name;  ///< as the manifest has it: "position_error", "p95 position_error in hold"
  std::string unit;  ///< of its values; empty: none
  /// Of a procedure: what is measured on its run. nullptr in other experiments.
  const evaluation::Measurement* measurement = nullptr;
  evaluation::Statistic statistic = evaluation::Statistic::rms;
  std::string phase;
};

/// Where the things are that a manifest names. A campaign's directory holds copies of its own.
struct Places {
  std::filesystem::path procedure;
  std::filesystem::path config;
  std::string target;
  std::map<std::string, std::string> targets;  ///< of a list of several: by name
};

inline constexpr char target_axis[] = "target";  ///< of the grid, where there are several targets

/// A target of some trials.
struct CampaignTarget {
  std::string name;   ///< value of the axis `target` of the grid; empty where there is one alone
  std::string place;  ///< as load_target() takes it; empty: the experiment's own
  double length = 0;  ///< m; 0: as Manifest::target_length
};

/// What a campaign is: which experiment, under which conditions, how often. Trial i follows from
/// this and i alone; see trial.h.
///
/// All combinations of the values in `grid` are the points, the last parameter running fastest.
/// Trials go round the points: trial i is at point i % points().
struct Manifest {
  std::string file;  ///< for messages
  std::string text;
  std::string name;
  std::string description;
  /// "procedure": a procedure in the twin; "acquisition": single scans of a target in empty space.
  std::string experiment;
  Places places;
  std::string layout;        ///< of a procedure; empty: its own
  std::string world;         ///< of a procedure; empty: its own
  double target_length = 0;  ///< m; 0: the procedure's own, of the acquisition 3 m
  /// Several targets: the values of the grid's first axis, `target`. Empty: places.target alone.
  std::vector<CampaignTarget> targets;
  std::vector<std::string> notes;  ///< what a user should know: a target left out
  std::uint64_t seed = 1;          ///< of all trials
  std::int64_t trials = 0;         ///< at each point
  std::int64_t block = 0;          ///< trials that a worker takes at a time; 0: campaign.h chooses
  double trial_limit_s = 600;      ///< of processor time; a trial that takes more is ended
  std::vector<Parameter> fixed;    ///< the same in all trials, one value each
  std::vector<Parameter> grid;     ///< one value for each place of an axis
  std::vector<Parameter> drawn;    ///< anew in each trial
  std::vector<KeptMeasurement> measurements;

  std::int64_t points() const;
  std::int64_t total() const { return points() * trials; }
  /// Which value of each grid parameter a point has.
  std::vector<std::size_t> place_of(std::int64_t point) const;
  /// The target of a trial with such parameters.
  CampaignTarget target_of(
      const std::vector<std::pair<std::string, std::string>>& parameters) const;
};

/// Reads and checks a manifest: keys, units, names of parameters and measurements, every value of
/// the grid. Paths are relative to its own directory.
///
///     name: approach
///     procedure: ../procedures/approach.yaml   # or   experiment: acquisition
///     target: radarsat2
///     # or several, each a value of an axis `target`; one in the folder of a variable of the
///     # environment is left out, with a note, where that is not set
///     targets: [{target: radarsat2, length: 3 m}, {target: "${MESHES}/mir.ply", length: 2 m}]
///     seed: 1
///     trials: 200
///     grid:
///       simulation_lidar.yaml:noise_scale: [0.5, 1, 2]   # a key of a file of config/
///       speed: [10 mm/s, 20 mm/s]                        # a parameter of the procedure
///     draw:
///       hold: {uniform: [5 s, 10 s]}
///       start: [{normal: [0, 50]}, 0, 5500, any attitude]   # w p r, uniform over all attitudes
///     set: {standoff: 3.2 m}
///     measurements:
///       - time_to_acquire
///       - p95 position_error in hold     # [STATISTIC] MEASUREMENT [in PHASE]; rms, whole run
///
/// @throws InputError "file:line: key ...: found ..., expected ..."
Manifest load_manifest(const std::filesystem::path& file);
/// The same from text; places: where the named files are, instead of next to the manifest.
Manifest parse_manifest(const std::string& text, const std::string& file,
                        const Places* places = nullptr);

}  // namespace berth::campaigns
