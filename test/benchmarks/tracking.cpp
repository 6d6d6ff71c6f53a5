// SPDX-License-Identifier: BSD-3-Clause
// Targets 2 and 7: tracking accuracy against the Cramer-Rao bound, and consistency.
#include <algorithm>
#include <map>

#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/tracking_trial.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

using estimator::ScanStrategy;

constexpr double max_rms = 1.15;  // of the bound
constexpr double max_p95 = 2.2;   // of the bound
constexpr double min_ok = 0.99;   // of the trials; the target does not state it

struct Cell {
  int error_case;
  ScanStrategy strategy;
  int returns;

  std::string name() const {
    return "Error" + std::to_string(error_case) + " " +
           estimator::scan_strategy_names()[static_cast<std::size_t>(strategy)] + " " +
           std::to_string(returns);
  }
};

std::vector<Cell> cells(const Settings& settings) {
  std::vector<Cell> all;
  for (const int error_case : {1, 2, 3}) {
    for (const int returns : {200, 1000, 3000, 50000}) {
      for (int s = 0; s < 6; ++s) {
        const Cell cell{error_case, static_cast<ScanStrategy>(s), returns};
        if (settings.is_selected(cell.name() + " ")) all.push_back(cell);
      }
    }
  }
  return all;
}

/// Errors over each trial's own bound.
struct Ratios {
  std::vector<double> translation;
  std::vector<double> rotation;
};

Ratios ratios(const std::vector<TrackingOutcome>& outcomes) {
  Ratios r;
  for (const TrackingOutcome& o : outcomes) {
    if (!o.ok || !o.bound.exists) continue;
    r.translation.push_back(o.translation() / o.bound.translation);
    r.rotation.push_back(o.rotation() / o.bound.rotation);
  }
  return r;
}

double percentile_95(const std::vector<double>& values) { return quantile(values, 0.95); }

double rms_of(const std::vector<TrackingOutcome>& outcomes,
              double (*value)(const TrackingOutcome&)) {
  std::vector<double> values;
  for (const TrackingOutcome& o : outcomes) {
    if (o.ok && o.bound.exists) values.push_back(value(o));
  }
  return root_mean_square(values);
}

std::vector<std::string> describe(const std::string& method, const Cell& cell,
                                  const std::vector<TrackingOutcome>& outcomes, const Ratios& r) {
  const auto ok = static_cast<int>(
      std::count_if(outcomes.begin(), outcomes.end(), [](const auto& o) { return o.ok; }));
  std::vector<double> times;
  for (const auto& o : outcomes) times.push_back(o.cpu_ms);
  const auto worst = std::max_element(outcomes.begin(), outcomes.end(), [](auto& a, auto& b) {
    return a.translation() / a.bound.translation < b.translation() / b.bound.translation;
  });
  return {
      method,
      "Error" + std::to_string(cell.error_case),
      estimator::scan_strategy_names()[static_cast<std::size_t>(cell.strategy)],
      std::to_string(cell.returns),
      share(ok, static_cast<int>(outcomes.size())),
      number(1e3 * rms_of(outcomes, [](const TrackingOutcome& o) { return o.translation(); }), 3),
      number(1e3 * rms_of(outcomes, [](const TrackingOutcome& o) { return o.bound.translation; }),
             3),
      with_interval(root_mean_square(r.translation), bootstrap(r.translation, root_mean_square)),
      number(percentile_95(r.translation)),
      number(degrees(rms_of(outcomes, [](const TrackingOutcome& o) { return o.rotation(); })), 4),
      number(degrees(rms_of(outcomes, [](const TrackingOutcome& o) { return o.bound.rotation; })),
             4),
      with_interval(root_mean_square(r.rotation), bootstrap(r.rotation, root_mean_square)),
      number(percentile_95(r.rotation)),
      number(median(times), 3),
      std::to_string(worst - outcomes.begin()),
  };
}

const std::vector<std::string> columns = {
    "method", "noise", "strategy",  "returns",     "ok",  "mm",     "bound mm",    "rms / bound",
    "p95",    "deg",   "bound deg", "rms / bound", "p95", "CPU ms", "worst trial", "target"};

/// Normalised squared errors of the scans that were tracked.
struct Consistency {
  double sum = 0;
  int scans = 0;

  void add(const std::vector<TrackingOutcome>& outcomes) {
    for (const TrackingOutcome& o : outcomes) {
      if (!o.ok || !o.bound.exists) continue;
      sum += o.nees;
      ++scans;
    }
  }
  double mean() const { return sum / scans; }
};

/// Consistency of scans, in the band for one of so many rows; judged in the world that the
/// estimator models.
void judge(Table& table, std::vector<std::string> row, const Consistency& of, int rows, bool full) {
  const Bounds band = mean_chi_square_band(of.scans, 6, rows);
  row.push_back(number(of.mean()));
  row.push_back(number(band.low) + ".." + number(band.high));
  if (full) {
    table.add(std::move(row));
  } else {
    table.judge(std::move(row), band.contains(of.mean()));
  }
}

/// Runs one world. full: with what the estimator does not model, printed and not judged.
int accuracy(const Settings& settings, bool full) {
  const auto model = model_of(settings);
  const auto all = cells(settings);
  const std::string world = full ? "full-physics" : "beam-noise";
  Table table(full ? "tracking_full_physics" : "tracking",
              "Tracking, " + world +
                  " world, paper's pose and 15 deg / 0.1 m around it, start 30 "
                  "mm and 2 deg off, " +
                  std::to_string(settings.trials) + " trials a row" +
                  (full ? "" : "; target: rms at most 1.15, p95 at most 2.2 times the bound"),
              columns);
  Table nees("consistency" + std::string(full ? "_full_physics" : ""),
             "Consistency, " + world +
                 " world: mean of e' P^-1 e, 6 expected; family-wise 95 % band, over the "
                 "strategies' rows and over those of all together",
             {"method", "noise", "strategy", "returns", "mean", "band", "target"});
  for (const std::string& name : settings.tracking_methods) {
    std::map<std::pair<int, int>, Consistency> together;  // by noise and returns
    for (const Cell& cell : all) {
      TrackingCase the_case;
      the_case.physics.noise = table_1_noise(cell.error_case);
      if (full) the_case.physics = full_physics(the_case.physics.noise);
      the_case.strategy = cell.strategy;
      the_case.returns = cell.returns;
      const auto subject = tracking_named(settings, name, model, the_case.physics.noise);
      const auto outcomes = results_of(
          name + " " + world + " " + cell.name(), settings.trials, settings.jobs, [&](int i) {
            const Random random(settings.seed, "tracking " + cell.name() + " " + std::to_string(i));
            return track(**subject, subject->noise, make_tracking_trial(*model, the_case, random));
          });
      const Ratios r = ratios(outcomes);
      auto row = describe(name, cell, outcomes, r);
      Consistency consistency;
      consistency.add(outcomes);
      judge(nees, {name, row[1], row[2], row[3]}, consistency, static_cast<int>(all.size()), full);
      together[{cell.error_case, cell.returns}].add(outcomes);
      if (full) {
        table.add(row);
        continue;
      }
      const auto ok = static_cast<int>(r.translation.size());
      const auto near_bound = [&settings](const std::vector<double>& errors) {
        return settings.yardstick.at_most(errors, root_mean_square, max_rms) &&
               settings.yardstick.at_most(errors, percentile_95, max_p95);
      };
      table.judge(row, settings.yardstick.share_at_least(ok, settings.trials, min_ok) &&
                           near_bound(r.translation) && near_bound(r.rotation));
    }
    for (const auto& [cell, consistency] : together) {
      judge(nees, {name, "Error" + std::to_string(cell.first), "all", std::to_string(cell.second)},
            consistency, static_cast<int>(together.size()), full);
    }
  }
  table.publish(settings.out);
  nees.publish(settings.out);
  return table.missed() + nees.missed();
}

}  // namespace

int run_tracking(const Settings& settings) {
  return accuracy(settings, false) + accuracy(settings, true);
}

}  // namespace berth::benchmark
