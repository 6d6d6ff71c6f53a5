// SPDX-License-Identifier: BSD-3-Clause
// The paper's Figures 9 and 10: tracking in steps and in motion (sections 5.3.2 and 5.3.3).
#include <algorithm>

#include "test/benchmarks/closed_loop.h"
#include "test/benchmarks/figure.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/tracking_trial.h"

namespace berth::benchmark {
namespace {

using estimator::ScanStrategy;

/// Static scans between which the target moves 30 mm along z, filtered with alpha 0.8.
void figure_9(const Settings& settings, std::shared_ptr<const estimator::TargetModel> model) {
  constexpr int frames = 25;
  constexpr double step_m = 0.030;
  constexpr std::int64_t period_us = 1000000;
  Table table(
      "figure_9",
      "Figure 9: 30 mm steps in z, corners+sparse, 1,000 returns, alpha 0.8; after five "
      "frames. The paper: translation error below 10 mm, changes in orientation below 1 deg, "
      "RMS below 30 mm",
      {"method", "max error mm", "max change of orientation deg", "max RMS residual mm"});
  Figure figure("figure_9", 1100, 420);
  std::string shifts;
  std::string turns;
  std::size_t colour = 0;
  Physics physics;
  const World world(model->target.mesh, physics, Random(settings.seed, "figure 9"));
  for (const std::string& name : published_and_tested(settings)) {
    const auto subject = tracking_named(settings, name, model, physics.noise);
    subject->options.tracker_method = "alpha_beta";
    subject->options.alpha_beta.alpha = 0.8;
    const auto filter = estimator::make_tracker(subject->options);
    const estimator::PlannerOptions planner_options;
    const estimator::ScanPlanner planner(*model, {}, planner_options);
    Random random(settings.seed, "figure 9");
    Pose truth = pose_from_xyzwpr({100, -230, 6000, 25, 20, -30});
    std::int64_t utime = World::first_utime;
    Matrix6d start_covariance = Matrix6d::Identity() * 1e-4;
    filter->start(pose_off(truth, 0.01, radians(0.5), random), start_covariance, utime);
    std::vector<std::vector<double>> rows;
    Pose last = filter->pose();
    double worst_mm = 0;
    double worst_turn = 0;
    double worst_rms = 0;
    for (int frame = 0; frame < frames; ++frame) {
      TrackingTrial trial;
      trial.truth = truth;
      utime += period_us;
      trial.predicted = {filter->predict(utime), filter->predicted_covariance(utime), {}};
      const auto windows =
          planner.plan(trial.predicted.pose, 0.01, ScanStrategy::corners_sparse, 1000);
      trial.scan = world.sweep(scaled_to_returns(world, windows, truth, 1000), truth, random);
      const estimator::TrackingResult result = (*subject)->track(
          estimator::preprocess(trial.scan.beams, {1, 15}, physics.noise), trial.predicted);
      if (result.ok) filter->update(result.pose, result.covariance, utime);
      const Pose& now = filter->pose();
      const Vector3d shift = 1e3 * (now.position - last.position);
      const Vector3d turn = rotation_vector(now.rotation * last.rotation.conjugate());
      const double error = 1e3 * distance(truth, now);
      rows.push_back({1.0 * frame, shift.x(), shift.y(), shift.z(), degrees(turn.x()),
                      degrees(turn.y()), degrees(turn.z()), error,
                      degrees(angle_between(truth, now)), 1e3 * result.residual_rms});
      if (frame >= 5) {
        worst_mm = std::max(worst_mm, error);
        worst_turn = std::max(worst_turn, degrees(turn.norm()));
        worst_rms = std::max(worst_rms, 1e3 * result.residual_rms);
      }
      last = now;
      truth.position.z() += step_m;
    }
    write_numbers(settings.out / ("figure_9_" + name + ".csv"),
                  {"frame", "dx mm", "dy mm", "dz mm", "turn x deg", "turn y deg", "turn z deg",
                   "error mm", "error deg", "rms mm"},
                  rows);
    table.add({name, number(worst_mm), number(worst_turn, 3), number(worst_rms)});
    const std::string block = "m" + std::to_string(colour);
    figure.data(block, rows);
    constexpr const char* axes[] = {"x", "y", "z"};
    for (int i = 0; i < 3; ++i) {
      const std::string style = std::string(" with linespoints pt ") + (colour == 0 ? "4" : "7") +
                                " ps 0.5 dt " + (colour == 0 ? "2" : "1") + " lc rgb '" +
                                colour_of(static_cast<std::size_t>(i)) + "' title '" + name + ", " +
                                axes[i] + "'";
      shifts +=
          (shifts.empty() ? "plot $" : ", $") + block + " using 1:" + std::to_string(2 + i) + style;
      turns +=
          (turns.empty() ? "plot $" : ", $") + block + " using 1:" + std::to_string(5 + i) + style;
    }
    ++colour;
  }
  figure.line(
      "set multiplot layout 1,2\nset grid lc rgb '#e0e0e0'\nset xlabel 'frame'\nset key "
      "noenhanced");
  figure.line("set title 'change of position between frames (30 mm in z)'\nset ylabel 'mm'\n" +
              shifts);
  figure.line("set title 'change of orientation between frames'\nset ylabel 'deg'\n" + turns);
  figure.line("unset multiplot");
  figure.draw(settings.out);
  table.publish(settings.out);
}

/// A replica that moves while it is scanned: the whole estimator.
void figure_10(const Settings& settings, std::shared_ptr<const estimator::TargetModel> model) {
  Table table("figure_10",
              "Figure 10: moving replica, 46 scans of 2,500 beams, 37 mm/s and 1.5 deg/s",
              {"method", "filter", "scans", "ok", "rms mm", "max mm", "rms deg", "max deg"});
  Figure figure("figure_10", 1200, 850);
  std::string position = "plot ";
  std::string attitude = "plot ";
  std::string errors;
  Physics physics;
  const World world(model->target.mesh, physics, Random(settings.seed, "figure 10"));
  const auto methods = published_and_tested(settings);
  for (std::size_t m = 0; m < methods.size(); ++m) {
    estimator::EstimatorOptions options = settings.options;
    options.tracking_method = methods[m];
    options.tracker_method = m == 0 ? "alpha_beta" : "se3";
    if (m == 0) options.icp_tracking.deskew = false;  // as published
    options.returns_per_scan = 2500;
    Random random(settings.seed, "figure 10");
    const Pose start = pose_from_xyzwpr({250, -150, 6500, 25, 20, -30});
    const Velocity velocity{{-0.008, 0.005, -0.036},
                            radians(1.5) * Vector3d(0.2, 0.9, 0.4).normalized()};
    ClosedLoop loop(options, model, world.physics().noise,
                    source_of(world, start, velocity, random), start, velocity);
    loop.track_from(pose_off(start, 0.030, radians(2), random));
    loop.run(46 * (2500 / physics.rate_hz + options.request_latency_s));
    std::vector<std::vector<double>> rows;
    std::vector<double> mm;
    std::vector<double> deg;
    for (const LoopEstimate& e : loop.estimates()) {
      if (!e.ok) continue;
      const Xyzwpr pose = xyzwpr_from_pose(e.pose);
      const Xyzwpr truth = xyzwpr_from_pose(e.truth);
      mm.push_back(1e3 * e.error().head<3>().norm());
      deg.push_back(degrees(e.error().tail<3>().norm()));
      std::vector<double> row = {static_cast<double>(e.scan_id)};
      row.insert(row.end(), pose.begin(), pose.end());
      row.insert(row.end(), truth.begin(), truth.end());
      row.insert(row.end(), {mm.back(), deg.back(), 1.0 * e.returns});
      rows.push_back(row);
    }
    write_numbers(settings.out / ("figure_10_" + methods[m] + ".csv"),
                  {"scan", "x", "y", "z", "w", "p", "r", "true x", "true y", "true z", "true w",
                   "true p", "true r", "error mm", "error deg", "returns"},
                  rows);
    table.add({methods[m], options.tracker_method, std::to_string(loop.estimates().size()),
               std::to_string(mm.size()), number(root_mean_square(mm)), number(quantile(mm, 1)),
               number(root_mean_square(deg), 3), number(quantile(deg, 1), 3)});
    const std::string block = "m" + std::to_string(m);
    figure.data(block, rows);
    errors += (m == 0 ? "plot $" : ", $") + block +
              " using 1:COLUMN with linespoints pt 7 ps 0.4 lc rgb '" + colour_of(m) + "' title '" +
              methods[m] + "'";
    if (m + 1 < methods.size()) continue;
    constexpr const char* names[] = {"x", "y", "z", "w", "p", "r"};
    for (int i = 0; i < 6; ++i) {
      std::string& plot = i < 3 ? position : attitude;
      const std::string colour = colour_of(static_cast<std::size_t>(i % 3));
      plot += std::string(i % 3 == 0 ? "$" : ", $") + block + " using 1:" + std::to_string(2 + i) +
              " with points pt 7 ps 0.5 lc rgb '" + colour + "' title '" + names[i] + "', $" +
              block + " using 1:" + std::to_string(8 + i) + " with lines lc rgb '" + colour +
              "' title 'true " + names[i] + "'";
    }
  }
  const auto with_column = [&errors](const char* column) {
    std::string plot = errors;
    for (std::size_t at; (at = plot.find("COLUMN")) != std::string::npos;)
      plot.replace(at, 6, column);
    return plot;
  };
  figure.line(
      "set multiplot layout 2,2\nset grid lc rgb '#e0e0e0'\nset xlabel 'scan'\nset key noenhanced");
  figure.line("set title 'position: " + methods.back() + "'\nset ylabel 'mm'\n" + position);
  figure.line("set title 'orientation: " + methods.back() + "'\nset ylabel 'deg'\n" + attitude);
  figure.line("set title 'position error'\nset ylabel 'mm'\nset logscale y\n" + with_column("14"));
  figure.line("set title 'orientation error'\nset ylabel 'deg'\n" + with_column("15"));
  figure.line("unset multiplot");
  figure.draw(settings.out);
  table.publish(settings.out);
}

}  // namespace

int run_paper_tracking(const Settings& settings) {
  const auto model = model_of(settings);
  if (settings.is_selected("figure_9 ")) figure_9(settings, model);
  if (settings.is_selected("figure_10 ")) figure_10(settings, model);
  return 0;
}

}  // namespace berth::benchmark
