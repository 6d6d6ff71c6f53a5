// SPDX-License-Identifier: BSD-3-Clause
// Target 5: a moving target, whole scans and streamed packets.
#include <algorithm>
#include <map>

#include "test/benchmarks/closed_loop.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/tracking_trial.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

// The filter learns the motion, then is measured while the target passes the pose at which it is
// measured at rest: the view decides more than the motion does.
constexpr double settling_s = 4;
constexpr double passing_s = 5;
constexpr double duration_s = 6;
constexpr int scans_per_run = 4;
constexpr double max_growth = 1.5;

struct Cell {
  bool moving;
  bool streaming;
  const char* tracker;
};

struct Errors {
  std::vector<double> mm;  // of the last estimate of each scan
  std::vector<double> deg;
  std::vector<double> present_mm;  // when the scan ends
  int scans = 0;
  int ok = 0;
};

Errors run_once(const Settings& settings, const std::string& method, const Cell& cell,
                std::shared_ptr<const estimator::TargetModel> model, const World& world,
                int index) {
  Random random(settings.seed, "motion " + std::to_string(index));
  estimator::EstimatorOptions options = settings.options;
  options.tracking_method = method;
  options.tracker_method = cell.tracker;
  options.streaming = cell.streaming;
  options.returns_per_scan = 1000;
  const Pose passed = pose_around(paper_pose(), 0.1, radians(15), random);
  const Pose towards = pose_off({}, 0.020, radians(3), random);
  Velocity velocity;
  if (cell.moving) velocity = {towards.position, rotation_vector(towards.rotation)};
  const Pose start = moved(passed, velocity, -passing_s);
  ClosedLoop loop(options, std::move(model), world.physics().noise,
                  source_of(world, start, velocity, random), start, velocity);
  loop.track_from(pose_off(start, 0.030, radians(2), random));
  loop.run(duration_s);
  std::map<std::int64_t, const LoopEstimate*> last;
  for (const LoopEstimate& e : loop.estimates()) last[e.scan_id] = &e;
  Errors errors;
  for (const auto& [scan, estimate] : last) {
    if (estimate->time < settling_s) continue;
    ++errors.scans;
    if (!estimate->ok) continue;
    ++errors.ok;
    errors.mm.push_back(1e3 * estimate->error().head<3>().norm());
    errors.deg.push_back(degrees(estimate->error().tail<3>().norm()));
    errors.present_mm.push_back(1e3 * estimate->present_error().head<3>().norm());
  }
  return errors;
}

Errors all_of(const std::vector<Errors>& runs) {
  Errors all;
  for (const Errors& e : runs) {
    all.mm.insert(all.mm.end(), e.mm.begin(), e.mm.end());
    all.deg.insert(all.deg.end(), e.deg.begin(), e.deg.end());
    all.present_mm.insert(all.present_mm.end(), e.present_mm.begin(), e.present_mm.end());
    all.scans += e.scans;
    all.ok += e.ok;
  }
  return all;
}

}  // namespace

int run_motion(const Settings& settings) {
  const auto model = model_of(settings);
  Physics physics;
  const World world(model->target.mesh, physics, Random(settings.seed, "motion"));
  const int runs = std::max(4, settings.trials / scans_per_run);
  Table table(
      "motion",
      "Motion, 20 mm/s and 3 deg/s, 2,000 beams/s, scans of 1,000, " + std::to_string(runs) +
          " runs a row; filtered pose of each scan; target: at most 1.5 times that at rest; "
          "known when the scan ends: streaming every 50 returns no worse than per scan",
      {"method", "filter", "estimates", "target is", "scans ok", "rms mm", "rms deg",
       "mm / at rest", "deg / at rest", "mm when the scan ends", "/ per scan", "target"});
  for (const std::string& name : settings.tracking_methods) {
    std::map<bool, Errors> per_scan;  // by moving
    for (const char* tracker : {"alpha_beta", "se3"}) {
      for (const bool streaming : {false, true}) {
        if (streaming && std::string(tracker) != "se3") continue;
        Errors at_rest;
        for (const bool moving : {false, true}) {
          const Cell cell{moving, streaming, tracker};
          const std::string label = std::string("motion ") + name + " " + tracker +
                                    (streaming ? " streaming" : "") +
                                    (moving ? " moving" : " rest");
          if (!settings.is_selected(label + " ")) continue;
          const Errors e = all_of(results_of(label, runs, settings.jobs, [&](int i) {
            return run_once(settings, name, cell, model, world, i);
          }));
          if (!moving) at_rest = e;
          if (!streaming) per_scan[moving] = e;
          const double mm = root_mean_square(e.mm);
          const double deg = root_mean_square(e.deg);
          const double growth = mm / root_mean_square(at_rest.mm);
          const double turn_growth = deg / root_mean_square(at_rest.deg);
          const double present = root_mean_square(e.present_mm);
          const double against_scans = present / root_mean_square(per_scan[moving].present_mm);
          const bool as_published = std::string(tracker) == "alpha_beta";
          std::vector<std::string> row = {name,
                                          tracker,
                                          streaming ? "streamed" : "per scan",
                                          moving ? "moving" : "at rest",
                                          share(e.ok, e.scans),
                                          with_interval(mm, bootstrap(e.mm, root_mean_square)),
                                          number(deg, 4),
                                          moving ? number(growth) : "",
                                          moving ? number(turn_growth) : "",
                                          number(present),
                                          streaming ? number(against_scans) : ""};
          if (as_published || (!moving && !streaming)) {
            table.add(row);
            continue;
          }
          const bool steady = !moving || (growth <= max_growth && turn_growth <= max_growth);
          table.judge(row, steady && (!streaming || against_scans <= 1.05));
        }
      }
    }
  }
  table.publish(settings.out);
  return table.missed();
}

}  // namespace berth::benchmark
