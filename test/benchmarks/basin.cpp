// SPDX-License-Identifier: BSD-3-Clause
// Target 3: from how far off tracking comes home, every time.
#include <algorithm>

#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/tracking_trial.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

struct Cell {
  double start_m;
  double start_deg;
  bool whole_target;

  std::string name() const {
    return number(1e3 * start_m, 0) + " mm " + number(start_deg, 0) + " deg " +
           (whole_target ? "raster" : "corners+sparse");
  }
};

bool home(const TrackingOutcome& o) {
  return o.translation() <= 0.015 && o.rotation() <= radians(1);
}

}  // namespace

int run_basin(const Settings& settings) {
  const auto model = model_of(settings);
  Table table(
      "basin",
      "Basin, 1,000 returns, 10 mm and 0.1 mrad, paper's pose and 15 deg / 0.1 m around it; "
      "home: within 15 mm and 1 deg; target: every trial",
      {"method", "start", "home", "ok", "ok but not home", "median mm", "p95 mm", "worst mm",
       "worst deg", "target"});
  for (const std::string& name : settings.tracking_methods) {
    const auto subject = tracking_named(settings, name, model, table_1_noise(1));
    for (const Cell& cell : {Cell{0.030, 2, true}, Cell{0.100, 5, true}, Cell{0.030, 2, false},
                             Cell{0.100, 5, false}}) {
      if (!settings.is_selected(cell.name() + " ")) continue;
      TrackingCase the_case;
      the_case.physics.noise = subject->noise;
      the_case.strategy = estimator::ScanStrategy::corners_sparse;
      the_case.whole_target = cell.whole_target;
      the_case.start_m = cell.start_m;
      the_case.start_rad = radians(cell.start_deg);
      const auto outcomes = results_of(
          "basin " + name + " " + cell.name(), settings.trials, settings.jobs, [&](int i) {
            const Random random(settings.seed, "basin " + cell.name() + " " + std::to_string(i));
            return track(**subject, subject->noise, make_tracking_trial(*model, the_case, random));
          });
      std::vector<double> mm;
      std::vector<double> deg;
      int at_home = 0;
      int ok = 0;
      int wrong = 0;
      for (const TrackingOutcome& o : outcomes) {
        mm.push_back(1e3 * o.translation());
        deg.push_back(degrees(o.rotation()));
        at_home += home(o) ? 1 : 0;
        ok += o.ok ? 1 : 0;
        wrong += o.ok && !home(o) ? 1 : 0;
      }
      const int n = settings.trials;
      table.judge(
          {name, cell.name(), share(at_home, n), share(ok, n), share(wrong, n), number(median(mm)),
           number(quantile(mm, 0.95)), number(quantile(mm, 1)), number(quantile(deg, 1))},
          at_home == n);
    }
  }
  table.publish(settings.out);
  return table.missed();
}

}  // namespace berth::benchmark
