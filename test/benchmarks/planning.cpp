// SPDX-License-Identifier: BSD-3-Clause
// Target 6: what planned windows are worth, against the best choice of rays and uniform scans.
#include <algorithm>
#include <cmath>

#include "test/benchmarks/figure.h"
#include "test/benchmarks/optimal_rays.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/tracking_trial.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

/// Flatter beams have, to first order, information that no estimator could use.
constexpr double min_cosine = 0.1;
constexpr int returns = 1000;

struct Cell {
  const char* name;
  double start_m;
  double start_deg;
  bool judged;
};

struct Result {
  double planned = 0;  // rms bounds, m
  double uniform = 0;
  double optimal = 0;           // 0: not worked out
  double optimal_repeated = 0;  // likewise
  TrackingOutcome planned_outcome;
  TrackingOutcome uniform_outcome;
};

double bound_of(const TrackingTrial& trial, const BeamModel& noise, double lever) {
  Matrix6d information = Matrix6d::Zero();
  for (std::size_t i = 0; i < trial.scan.beams.size(); ++i) {
    const RawBeam& beam = trial.scan.beams[i];
    const Vector3d u = beam_direction(beam.azimuth, beam.elevation);
    if (-trial.scan.faces[i].normal.dot(u) < min_cosine) continue;
    information += fisher_information(u, trial.scan.faces[i], trial.truth, noise);
  }
  return rms_bound(information, lever);
}

Result run_trial(const Settings& settings, const Cell& cell,
                 const Subject<estimator::Tracking>& subject, int index, bool with_optimum) {
  const estimator::TargetModel& model = *subject.model;
  const Random random(settings.seed, std::string("planning ") + cell.name + std::to_string(index));
  const double lever = 0.5 * model.target.length;
  TrackingCase the_case;
  the_case.physics.noise = subject.noise;
  the_case.returns = returns;
  the_case.start_m = cell.start_m;
  the_case.start_rad = radians(cell.start_deg);
  the_case.strategy = estimator::ScanStrategy::information;
  const TrackingTrial planned = make_tracking_trial(model, the_case, random);
  the_case.whole_target = true;
  the_case.returns = planned.scan.returns;
  const TrackingTrial uniform = make_tracking_trial(model, the_case, random);
  Result r;
  r.planned = bound_of(planned, subject.noise, lever);
  r.uniform = bound_of(uniform, subject.noise, lever);
  r.planned_outcome = track(*subject, subject.noise, planned);
  r.uniform_outcome = track(*subject, subject.noise, uniform);
  if (with_optimum) {
    const World world(model.target.mesh, the_case.physics, random);
    const Window window = window_around(model.target.mesh, planned.truth, 0.02);
    const int rays = planned.scan.returns;
    r.optimal = optimal_rms_bound(world, window, planned.truth, rays, lever, min_cosine, 1);
    r.optimal_repeated =
        optimal_rms_bound(world, window, planned.truth, rays, lever, min_cosine, rays);
  }
  return r;
}

/// RMS of a method's error, rotations times the lever, as the bounds have them, m.
double rms_error(const std::vector<Result>& results, TrackingOutcome Result::*which, double lever) {
  std::vector<double> errors;
  for (const Result& r : results) {
    const TrackingOutcome& o = r.*which;
    if (o.ok) errors.push_back(std::hypot(o.translation(), lever * o.rotation()));
  }
  return root_mean_square(errors);
}

int ok_count(const std::vector<Result>& results, TrackingOutcome Result::*which) {
  return static_cast<int>(std::count_if(results.begin(), results.end(),
                                        [&](const Result& r) { return (r.*which).ok; }));
}

void write_trials(const std::filesystem::path& path, const std::vector<Result>& results) {
  std::vector<std::vector<double>> rows;
  for (const Result& r : results) {
    rows.push_back({static_cast<double>(rows.size()), 1e3 * r.planned, 1e3 * r.uniform,
                    1e3 * r.optimal, 1e3 * r.optimal_repeated,
                    1e3 * r.planned_outcome.translation(), degrees(r.planned_outcome.rotation()),
                    1e3 * r.uniform_outcome.translation(), degrees(r.uniform_outcome.rotation()),
                    static_cast<double>(r.planned_outcome.returns)});
  }
  write_numbers(path,
                {"trial", "planned mm", "uniform mm", "A-optimal mm", "repeated mm",
                 "error planned mm", "deg", "error uniform mm", "deg", "returns"},
                rows);
}

}  // namespace

int run_planning(const Settings& settings) {
  const auto model = model_of(settings);
  const double lever = 0.5 * model->target.length;
  const int optima = std::clamp(settings.trials / 20, 2, 50);  // each takes seconds
  Table table(
      "planning",
      "Planning, 1,000 returns, 10 mm and 0.1 mrad, paper's pose and 15 deg / 0.1 m around "
      "it; rms: translation and rotation times half the length; A-optimal over " +
          std::to_string(optima) +
          " poses, single rays or repeated ones; target: bound at most 1.25 of A-optimal, "
          "1.5 times more accurate than uniform",
      {"method", "prediction off by", "bound planned mm", "uniform mm", "A-optimal mm",
       "repeated mm", "planned / A-optimal", "/ repeated", "uniform / planned, bound", "ok planned",
       "rms error planned mm", "uniform mm", "uniform / planned, error", "target"});
  for (const std::string& name : settings.tracking_methods) {
    const auto subject = tracking_named(settings, name, model, table_1_noise(1));
    for (const Cell& cell :
         {Cell{"5 mm 0.25 deg", 0.005, 0.25, true}, Cell{"30 mm 2 deg", 0.030, 2, false}}) {
      if (!settings.is_selected(std::string(cell.name) + " ")) continue;
      const auto results = results_of(
          std::string("planning ") + name + " " + cell.name, settings.trials, settings.jobs,
          [&](int i) { return run_trial(settings, cell, *subject, i, i < optima); });
      write_trials(settings.out / ("planning_trials_" + name + "_" + cell.name + ".csv"), results);
      std::vector<double> planned;
      std::vector<double> uniform;
      std::vector<double> optimal;
      std::vector<double> repeated;
      std::vector<double> ratio;
      std::vector<double> strict_ratio;
      for (const Result& r : results) {
        planned.push_back(1e3 * r.planned);
        uniform.push_back(1e3 * r.uniform);
        if (r.optimal <= 0) continue;
        optimal.push_back(1e3 * r.optimal);
        repeated.push_back(1e3 * r.optimal_repeated);
        ratio.push_back(r.planned / r.optimal);
        strict_ratio.push_back(r.planned / r.optimal_repeated);
      }
      const double error = 1e3 * rms_error(results, &Result::planned_outcome, lever);
      const double uniform_error = 1e3 * rms_error(results, &Result::uniform_outcome, lever);
      std::vector<std::string> row = {
          name,
          cell.name,
          number(root_mean_square(planned), 3),
          number(root_mean_square(uniform), 3),
          number(root_mean_square(optimal), 3),
          number(root_mean_square(repeated), 3),
          with_interval(root_mean_square(ratio), bootstrap(ratio, root_mean_square)),
          number(root_mean_square(strict_ratio)),
          number(root_mean_square(uniform) / root_mean_square(planned)),
          share(ok_count(results, &Result::planned_outcome), settings.trials),
          number(error, 3),
          number(uniform_error, 3),
          number(uniform_error / error)};
      if (cell.judged) {
        table.judge(row, settings.yardstick.at_most(ratio, root_mean_square, 1.25) &&
                             uniform_error >= 1.5 * error);
      } else {
        table.add(row);
      }
    }
  }
  table.publish(settings.out);
  return table.missed();
}

}  // namespace berth::benchmark
