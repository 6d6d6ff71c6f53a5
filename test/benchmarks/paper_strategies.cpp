// SPDX-License-Identifier: BSD-3-Clause
// The paper's Figure 8: strategies and noise (section 5.3.1).
#include <algorithm>
#include <cmath>
#include <map>

#include "test/benchmarks/figure.h"
#include "test/benchmarks/reference_registration.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

using estimator::ScanStrategy;

struct Bar {
  double mm = 0;  // maximum
  double deg = 0;
  double rms_mm = std::nan("");
  double ms = std::nan("");
};

Bar bar_of(const std::vector<TrackingOutcome>& outcomes) {
  Bar bar;
  std::vector<double> residuals;
  std::vector<double> times;
  for (const TrackingOutcome& o : outcomes) {
    bar.mm = std::max(bar.mm, 1e3 * o.translation());
    bar.deg = std::max(bar.deg, degrees(o.rotation()));
    residuals.push_back(1e3 * o.residual_rms);
    times.push_back(o.cpu_ms);
  }
  bar.rms_mm = root_mean_square(residuals);
  if (bar.rms_mm == 0) bar.rms_mm = std::nan("");  // a method that reports none
  bar.ms = median(times);
  return bar;
}

/// All methods on one strategy and noise.
std::map<std::string, Bar> compare(const Settings& settings,
                                   std::shared_ptr<const estimator::TargetModel> model,
                                   int error_case, int strategy) {
  TrackingCase the_case;
  the_case.physics.noise = table_1_noise(error_case);
  the_case.strategy = static_cast<ScanStrategy>(strategy);
  the_case.returns = strategy == 0 ? 50000 : 1000;  // the paper's
  the_case.around_m = 0;
  the_case.around_rad = 0;
  const std::string label = "figure 8 Error" + std::to_string(error_case) + " " +
                            estimator::scan_strategy_names()[static_cast<std::size_t>(strategy)];
  std::vector<TrackingTrial> trials =
      results_of(label, std::min(settings.trials, 100), settings.jobs, [&](int i) {
        const Random random(settings.seed, label + std::to_string(i));
        return make_tracking_trial(*model, the_case, random);
      });
  std::map<std::string, Bar> bars;
  for (const std::string& name : published_and_tested(settings)) {
    const auto subject = tracking_named(settings, name, model, the_case.physics.noise);
    bars[name] =
        bar_of(results_of(label + " " + name, static_cast<int>(trials.size()), 1, [&](int i) {
          return track(**subject, subject->noise, trials[static_cast<std::size_t>(i)]);
        }));
  }
  Bar& bound = bars["Cramer-Rao bound (rms)"];
  for (const TrackingTrial& t : trials) {
    bound.mm += 1e3 * t.bound.translation / static_cast<double>(trials.size());
    bound.deg += degrees(t.bound.rotation) / static_cast<double>(trials.size());
  }
  // PCL takes seconds for a dense scan.
  if (strategy == 0) trials.resize(std::min<std::size_t>(trials.size(), 10));
  for (const auto& [name, outcomes] :
       reference_registrations(points_of(*model), trials, settings.out / "clouds.txt")) {
    bars["PCL " + name] = bar_of(outcomes);
  }
  return bars;
}

}  // namespace

int run_paper_strategies(const Settings& settings) {
  const auto model = model_of(settings);
  Table table(
      "figure_8",
      "Figure 8: largest errors of " + std::to_string(std::min(settings.trials, 100)) +
          " scans at (100, -230, 8000, 25, 20, -30), start 30 mm and 2 deg off. The paper's "
          "bars are not in its text; its axes end at 8 mm, 0.5 deg, 25 mm RMS and 1,000 ms",
      {"noise", "strategy", "method", "max mm", "max deg", "RMS mm", "median ms"});
  Figure figure("figure_8", 1500, 1000);
  figure.line(
      "set multiplot layout 3,4\nset grid lc rgb '#e0e0e0'\nset xrange [0.5:6.5]\n"
      "set xtics ('dense' 1, 'sparse' 2, 'corners' 3, 'edges' 4, 'c+s' 5, 'e+s' 6)\n"
      "set key noenhanced font ',7' below\nset logscale y");
  for (int error_case = 1; error_case <= 3; ++error_case) {
    std::map<std::string, std::vector<std::vector<double>>> curves;
    for (int strategy = 0; strategy < 6; ++strategy) {
      for (const auto& [name, b] : compare(settings, model, error_case, strategy)) {
        curves[name].push_back({strategy + 1.0, b.mm, b.deg, b.rms_mm, b.ms});
        table.add({"Error" + std::to_string(error_case),
                   estimator::scan_strategy_names()[static_cast<std::size_t>(strategy)], name,
                   number(b.mm, 3), number(b.deg, 4), number(b.rms_mm, 2), number(b.ms, 3)});
      }
    }
    const char* titles[] = {"largest translation error, mm", "largest rotation error, deg",
                            "RMS residual, mm", "time, ms"};
    const double paper_axis[] = {8, 0.5, 25, 1000};
    for (int panel = 0; panel < 4; ++panel) {
      std::string plot = "plot " + number(paper_axis[panel], 1) +
                         " with lines dt 3 lc rgb '#808080' title 'end of the paper''s axis'";
      std::size_t colour = 0;
      for (const auto& [name, rows] : curves) {
        const std::string block = "e" + std::to_string(error_case) + "c" + std::to_string(colour);
        if (panel == 0) figure.data(block, rows);
        const bool shown = panel < 2 || name.find("bound") == std::string::npos;
        const bool has_residual = panel != 2 || name.find("PCL") == std::string::npos;
        if (shown && has_residual) {
          plot += ", $" + block + " using 1:" + std::to_string(2 + panel) +
                  " with linespoints pt 7 ps 0.6 lc rgb '" + colour_of(colour) + "' title '" +
                  name + "'";
        }
        ++colour;
      }
      figure.line(panel == 2 ? "unset logscale y\nset yrange [0:30]"
                             : "set logscale y\nset autoscale y");
      figure.line("set title 'Error" + std::to_string(error_case) + ": " + titles[panel] + "'\n" +
                  plot);
    }
  }
  figure.line("unset multiplot");
  figure.draw(settings.out);
  table.publish(settings.out);
  return 0;
}

}  // namespace berth::benchmark
