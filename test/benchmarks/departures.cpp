// SPDX-License-Identifier: BSD-3-Clause
// The estimator where the world departs from its model: each departure alone and together.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "test/benchmarks/closed_loop.h"
#include "test/benchmarks/cpu_time.h"
#include "test/benchmarks/departure_scene.h"
#include "test/benchmarks/figure.h"
#include "test/benchmarks/judge.h"
#include "test/benchmarks/reference_registration.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/tracking_trial.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

constexpr double start_m = 0.030;
constexpr double start_rad = radians(2);
constexpr int reference_points = 20000;
constexpr std::array<int, 3> filtered_scans = {5, 50, 200};

/// A target as the estimator models it.
struct Sighting {
  std::string target;
  std::string view;  ///< a bare mesh "free" in space or "held" by the arm; free and "described"
  std::shared_ptr<const estimator::TargetModel> model;  ///< of the bare mesh
  /// Else as target.yaml would describe it, by the surface's sigma in m.
  std::map<double, std::shared_ptr<const estimator::TargetModel>> described;
  std::shared_ptr<const PoseJudge> judge;  ///< of acquisition, where requested
  std::vector<SurfacePoint> points;        ///< for the registration that we compare with
  std::shared_ptr<const SceneMaker> scenes;

  bool is_acquired() const { return described.empty(); }  ///< else tracked alone
  const std::shared_ptr<const estimator::TargetModel>& model_in(const Departures& world) const {
    return is_acquired() ? model : described.at(surface_sigma(world));
  }
};

struct Cell {
  const Sighting* sighting = nullptr;  ///< as modelled
  const Sighting* seen = nullptr;      ///< what is there
  const Departures* world = nullptr;
  int returns = 0;
  bool filtered = false;  ///< the whole estimator over many scans, instead of single ones

  std::string name() const {
    return world->name + " " + sighting->target + " " + sighting->view +
           (filtered ? " filtered " : " ") + std::to_string(returns);
  }
  std::string file_name() const {
    std::string file = name();
    std::replace(file.begin(), file.end(), ' ', '_');
    return file;
  }
};

/// Errors of some poses, and how they compare with what was claimed.
struct Errors {
  std::vector<double> mm;
  std::vector<double> deg;
  std::vector<double> nees;
  std::vector<double> ms;  ///< of processor time
  int refused = 0;

  void add(const Vector6d& error) {
    mm.push_back(1e3 * error.head<3>().norm());
    deg.push_back(degrees(error.tail<3>().norm()));
  }
  void add(const Errors& other) {
    mm.insert(mm.end(), other.mm.begin(), other.mm.end());
    deg.insert(deg.end(), other.deg.begin(), other.deg.end());
    nees.insert(nees.end(), other.nees.begin(), other.nees.end());
    ms.insert(ms.end(), other.ms.begin(), other.ms.end());
    refused += other.refused;
  }
  int count() const { return static_cast<int>(mm.size()) + refused; }
};

struct CellResult {
  Tally tally;
  Reliability reliability;
  std::vector<double> acquisition_ms;  ///< of processor time
  Errors tracking;
  Errors reference;
  std::map<int, Errors> filtered;  ///< after so many scans

  void add(const CellResult& other) {
    tally.add(other.tally);
    reliability.add(other.reliability);
    acquisition_ms.insert(acquisition_ms.end(), other.acquisition_ms.begin(),
                          other.acquisition_ms.end());
    tracking.add(other.tracking);
    reference.add(other.reference);
    for (const auto& [scans, errors] : other.filtered) filtered[scans].add(errors);
  }
};

/// Of a cell: as many as requested, else so many that all of it ends within half an hour on
/// two cores.
int trials_of(const Settings& settings, const Cell& cell) {
  if (settings.trials_given) return settings.trials;
  if (cell.filtered) return 3;
  return cell.returns <= 1000 ? 30 : cell.returns <= 3000 ? 12 : cell.returns <= 10000 ? 6 : 3;
}

Verdict take_acquisition(const Cell& cell, const estimator::AcquisitionResult& found,
                         const Pose& truth, CellResult& result) {
  // Where another target is, no pose is right.
  const auto right = [&](const Pose& pose) {
    return cell.seen == cell.sighting && cell.sighting->judge->right(truth, pose);
  };
  std::vector<Pose> poses;
  for (const estimator::Hypothesis& h : found.hypotheses) poses.push_back(h.pose);
  const Verdict verdict = verdict_on(found.status, poses, right);
  result.tally.add(verdict, !poses.empty() && right(poses.front()));
  if (verdict == Verdict::lost) return verdict;
  for (const estimator::Hypothesis& h : found.hypotheses) {
    result.reliability.add(h.probability, right(h.pose));
  }
  return verdict;
}

/// The returns as the sensor sees them, nearer ones darker, with the target where it is and where
/// it was thought to be.
void draw_failure(const Settings& settings, const Cell& cell,
                  const estimator::PreprocessedScan& scan, const Pose& truth,
                  const estimator::AcquisitionResult& found) {
  Figure figure("failure_" + cell.file_name(), 720, 640);
  const auto degrees_of = [](const Vector3d& p) {
    double azimuth = 0, elevation = 0;
    beam_angles(p, azimuth, elevation);
    return std::vector<double>{degrees(azimuth), degrees(elevation), p.norm()};
  };
  std::vector<std::vector<double>> returns;
  for (const Vector3d& p : scan.points) returns.push_back(degrees_of(p));
  figure.data("returns", returns);
  figure.line(
      "set xlabel 'azimuth, deg'\nset ylabel 'elevation, deg'\nset cblabel 'range, m'\n"
      "set size ratio -1\nset palette defined (0 '#000000', 1 '#b0b0b0')\nset key outside top "
      "horizontal");
  std::string plot = "plot $returns with points pt 7 ps 0.5 palette title 'returns'";
  const auto add = [&](const char* block, const char* title, const char* colour,
                       const estimator::TargetModel& model, const Pose& pose) {
    std::vector<std::vector<double>> rows;
    for (const auto& s : model.surface.samples) {
      const Vector3d p = pose * s.position.cast<double>();
      if (p.dot(pose.rotation * s.normal.cast<double>()) < 0) rows.push_back(degrees_of(p));
    }
    figure.data(block, rows);
    plot += std::string(", $") + block + " with dots lc rgb '" + colour + "' title '" + title + "'";
  };
  add("truth", "the target", "#30a030", *cell.seen->model, truth);
  if (!found.hypotheses.empty()) {
    add("found", "the best hypothesis", "#c03030", *cell.sighting->model,
        found.hypotheses.front().pose);
  }
  figure.line(plot);
  figure.draw(settings.out);
}

void track_one(const estimator::Tracking& tracking, const estimator::PreprocessedScan& clean,
               const TrackingTrial& trial, Errors& errors) {
  const double before = cpu_ms();
  const estimator::TrackingResult tracked = tracking.track(clean, trial.predicted);
  errors.ms.push_back(cpu_ms() - before);
  if (!tracked.ok) {
    ++errors.refused;
    return;
  }
  const Vector6d error = difference(trial.truth, tracked.pose);
  errors.add(error);
  errors.nees.push_back(normalised_error_squared(error, tracked.covariance));
}

/// The beams that ended inside the gate: what both registrations get.
std::vector<RawBeam> within(std::vector<RawBeam> beams, const estimator::RangeGate& gate) {
  std::erase_if(beams, [&gate](const RawBeam& beam) {
    return beam.status != BeamStatus::hit || !gate.contains(beam.range);
  });
  return beams;
}

void single_scans(const Settings& settings, const Cell& cell, CellResult& result) {
  const Sighting& sighting = *cell.sighting;
  const SceneMaker& scenes = *cell.seen->scenes;
  AcquisitionSubject acquisition;
  if (sighting.judge != nullptr) {
    acquisition = acquisition_named(settings, settings.acquisition_methods.front(), sighting.model,
                                    scenes.noise());
  }
  TrackingSubject tracking;
  if (!cell.world->another && settings.tracking_methods.front() != no_method) {
    tracking = tracking_named(settings, settings.tracking_methods.front(),
                              sighting.model_in(*cell.world), scenes.noise());
  }
  std::vector<TrackingTrial> clouds;
  bool drawn = false;  // of a cell, one
  for (int i = 0; i < trials_of(settings, cell); ++i) {
    Random random(settings.seed, "departures " + cell.name() + " " + std::to_string(i));
    const auto scene = scenes.make(*cell.world, random);
    TrackingTrial trial;
    trial.truth = scene->truth();
    trial.scan = scene->scan(cell.returns);
    const estimator::PreprocessedScan clean =
        estimator::preprocess(trial.scan.beams, scenes.gate(), scenes.noise());
    if (acquisition) {
      const double before = cpu_ms();
      const estimator::AcquisitionResult found = (*acquisition)->acquire(clean);
      result.acquisition_ms.push_back(cpu_ms() - before);
      const Verdict verdict = take_acquisition(cell, found, trial.truth, result);
      const bool fine = verdict == Verdict::right || verdict == Verdict::ambiguous_with_truth ||
                        (cell.world->another && verdict == Verdict::lost);
      if (!fine && !std::exchange(drawn, true)) {
        draw_failure(settings, cell, clean, trial.truth, found);
      }
    }
    if (!tracking) continue;
    trial.predicted.pose = pose_off(trial.truth, start_m, start_rad, random);
    trial.predicted.covariance = Matrix6d::Zero();
    trial.predicted.covariance.diagonal().head<3>().setConstant(std::pow(start_m, 2) / 3);
    trial.predicted.covariance.diagonal().tail<3>().setConstant(std::pow(start_rad, 2) / 3);
    track_one(**tracking, clean, trial, result.tracking);
    trial.scan.beams = within(std::move(trial.scan.beams), scenes.gate());
    trial.scan.faces.clear();
    clouds.push_back(std::move(trial));
  }
  if (clouds.empty()) return;
  const auto registered = reference_registrations(
      sighting.points, clouds, settings.out / (cell.file_name() + ".txt"), {{0.15, 0.05}, false});
  for (const TrackingOutcome& outcome : registered.at("icp_with_normals")) {
    result.reference.add(outcome.error);
  }
}

/// The whole estimator tracks a target at rest: the same true surface, new noise in each scan.
void filtered_poses(const Settings& settings, const Cell& cell, CellResult& result) {
  const Sighting& sighting = *cell.sighting;
  estimator::EstimatorOptions options = settings.options;
  options.tracking_method = settings.tracking_methods.front();
  options.returns_per_scan = cell.returns;
  options.gate = sighting.scenes->gate();
  for (int i = 0; i < trials_of(settings, cell); ++i) {
    Random random(settings.seed, "departures " + cell.name() + " " + std::to_string(i));
    const auto scene = sighting.scenes->make(*cell.world, random);
    ClosedLoop loop(options, sighting.model_in(*cell.world), sighting.scenes->noise(),
                    [&scene](const std::vector<Window>& windows, std::int64_t utime) {
                      return scene->sweep(windows, utime);
                    },
                    scene->truth(), {});
    loop.track_from(pose_off(scene->truth(), start_m, start_rad, random));
    loop.run_scans(filtered_scans.back());
    for (const int scans : filtered_scans) {
      Errors& errors = result.filtered[scans];
      const auto at = static_cast<std::size_t>(scans) - 1;
      if (at >= loop.estimates().size() || !loop.estimates()[at].ok) {
        ++errors.refused;
        continue;
      }
      const LoopEstimate& estimate = loop.estimates()[at];
      errors.add(estimate.error());
      errors.nees.push_back(normalised_error_squared(estimate.error(), estimate.covariance));
    }
  }
}

CellResult run_cell(const Settings& settings, const Cell& cell) {
  const double start = cpu_ms();
  CellResult result;
  if (cell.filtered) {
    filtered_poses(settings, cell, result);
  } else {
    single_scans(settings, cell, result);
  }
  std::fprintf(stderr, "departures: %s, %.1f s\n", cell.name().c_str(), 1e-3 * (cpu_ms() - start));
  return result;
}

void append(std::vector<std::string>& row, const std::vector<std::string>& cells) {
  row.insert(row.end(), cells.begin(), cells.end());
}

const std::vector<std::string> error_columns = {"median mm", "p95 mm", "median deg", "p95 deg"};
std::vector<std::string> cells_of(const Errors& errors) {
  if (errors.mm.empty()) return std::vector<std::string>(error_columns.size(), "-");
  return {with_interval(median(errors.mm), bootstrap(errors.mm, median), 1),
          number(quantile(errors.mm, 0.95), 1), number(median(errors.deg)),
          number(quantile(errors.deg, 0.95))};
}

const std::vector<std::string> nees_columns = {"NEES mean", "NEES median"};
std::vector<std::string> nees_of(const Errors& errors) {
  if (errors.nees.empty()) return {"-", "-"};
  return {with_interval(mean(errors.nees), bootstrap(errors.nees, mean), 1),
          number(median(errors.nees), 1)};
}

/// Median and greatest.
std::vector<std::string> times_of(const std::vector<double>& ms) {
  if (ms.empty()) return {"-", "-"};
  return {number(median(ms), 1), number(*std::max_element(ms.begin(), ms.end()), 1)};
}

std::vector<std::string> with_prefix(const std::string& prefix,
                                     const std::vector<std::string>& columns) {
  std::vector<std::string> all;
  for (const std::string& c : columns) all.push_back(prefix + c);
  return all;
}

using Results = std::vector<std::pair<Cell, CellResult>>;

std::vector<std::string> single_columns(std::vector<std::string> first) {
  append(first, Tally::columns());
  append(first, {"acquisition ms", "greatest ms", "tracking refused"});
  append(first, error_columns);
  append(first, with_prefix("ICP ", error_columns));
  append(first, nees_columns);
  first.emplace_back("tracking ms");
  return first;
}

std::vector<std::string> single_row(std::vector<std::string> first, const CellResult& result) {
  append(first, result.tally.cells());
  append(first, times_of(result.acquisition_ms));
  first.push_back(share(result.tracking.refused, result.tracking.count()));
  append(first, cells_of(result.tracking));
  append(first, cells_of(result.reference));
  append(first, nees_of(result.tracking));
  first.push_back(times_of(result.tracking.ms).front());
  return first;
}

void publish_single(const Settings& settings, const Results& results) {
  Table table("departures",
              "Departures, single scans: acquisition without a prior; tracking and PCL's ICP with "
              "normals from starts 30 mm and 2 deg off; NEES: 6 expected",
              single_columns({"world", "target", "view", "returns"}));
  Table pooled("departures_summary", "Departures, single scans, all targets together",
               single_columns({"world", "view", "returns"}));
  std::map<std::pair<std::string, int>, CellResult> sums;
  std::vector<std::pair<std::string, int>> order;
  std::map<std::pair<std::string, int>, std::vector<std::string>> heads;
  for (const auto& [cell, result] : results) {
    if (cell.filtered) continue;
    table.add(single_row({cell.world->name, cell.sighting->target, cell.sighting->view,
                          std::to_string(cell.returns)},
                         result));
    const std::pair key(cell.world->name + " " + cell.sighting->view, cell.returns);
    if (sums.count(key) == 0) order.push_back(key);
    heads[key] = {cell.world->name, cell.sighting->view, std::to_string(cell.returns)};
    sums[key].add(result);
  }
  for (const auto& key : order) pooled.add(single_row(heads[key], sums[key]));
  table.publish(settings.out);
  pooled.publish(settings.out);
}

/// Of all trials or of none at all.
std::string per_cent(int part, int all) { return all == 0 ? "-" : number(100.0 * part / all, 1); }

/// As departures.md has it: a row for a world and target, of the bare mesh and of the described
/// one.
void publish_tracking(const Settings& settings, const Results& results) {
  using Key = std::pair<std::string, std::string>;
  std::vector<Key> order;
  std::map<Key, std::array<CellResult, 2>> cells;
  for (const auto& [cell, result] : results) {
    const std::string& view = cell.sighting->view;
    if (cell.filtered || cell.returns != 1000 || view == "held") continue;
    if (result.tracking.count() == 0) continue;
    const Key key(cell.world->name, cell.sighting->target);
    if (cells.count(key) == 0) order.push_back(key);
    cells[key].at(view == "described" ? 1 : 0) = result;
  }
  if (order.empty()) return;
  const auto millimetres = [](const Errors& errors) {
    if (errors.mm.empty()) return std::string("-");
    return number(median(errors.mm), 1) + ", " + number(quantile(errors.mm, 0.95), 1);
  };
  Table table("departures_tracking",
              "Departures, tracking of 1,000 returns in free space: median and 95th percentile of "
              "the error; mean NEES. ICP, refused in per cent and median ms of processor time: of "
              "the bare mesh; of the described target",
              {"world", "target", "bare mesh: mm, p95; NEES", "described: mm, p95; NEES",
               "ICP: mm, p95", "refused", "ms"});
  for (const Key& key : order) {
    const auto& [bare_mesh, described_target] = cells[key];
    const auto both = [&](const auto& text_of) {
      return text_of(bare_mesh) + "; " + text_of(described_target);
    };
    const auto tracked = [&](const CellResult& result) {
      return millimetres(result.tracking) + "; " + nees_of(result.tracking).front();
    };
    table.add(
        {key.first, key.second, tracked(bare_mesh), tracked(described_target),
         both([&](const CellResult& result) { return millimetres(result.reference); }),
         both([](const CellResult& result) {
           return per_cent(result.tracking.refused, result.tracking.count());
         }),
         both([](const CellResult& result) { return times_of(result.tracking.ms).front(); })});
  }
  table.publish(settings.out);
}

/// As departures.md has it: a row for a world, all targets together.
void publish_acquisition(const Settings& settings, const Results& results) {
  struct Sum {
    Tally tally;
    Tally without_cube;
    std::vector<double> ms;
  };
  constexpr const char* cube = "arc_chaser";  // its 24 attitudes differ by fittings
  std::vector<std::string> order;
  std::map<std::string, std::array<Sum, 2>> sums;
  for (const auto& [cell, result] : results) {
    if (cell.returns != 1000 || result.tally.trials == 0) continue;
    const std::string& world = cell.world->name;
    if (sums.count(world) == 0) order.push_back(world);
    Sum& sum = sums[world].at(cell.sighting->view == "held" ? 1 : 0);
    sum.tally.add(result.tally);
    if (cell.sighting->target.rfind(cube, 0) != 0) sum.without_cube.add(result.tally);
    sum.ms.insert(sum.ms.end(), result.acquisition_ms.begin(), result.acquisition_ms.end());
  }
  if (order.empty()) return;
  Table table("departures_acquisition",
              "Departures, acquisition of 1,000 returns, all targets together. Per cent right, "
              "ambiguous with the truth, ambiguous without, silently wrong, lost (in brackets "
              "right or ambiguous with the truth without arc_chaser); ms of processor time, median "
              "and greatest",
              {"world", "free", "ms", "held", "ms"});
  for (const std::string& world : order) {
    std::vector<std::string> row = {world};
    for (const Sum& sum : sums[world]) {
      const Tally& all = sum.tally;
      const Tally& few = sum.without_cube;
      std::string text = per_cent(all.right, all.trials);
      for (const int count :
           {all.ambiguous_with_truth, all.ambiguous_without, all.silently_wrong, all.lost}) {
        text += ", " + per_cent(count, all.trials);
      }
      text += " (" + per_cent(few.right + few.ambiguous_with_truth, few.trials) + ")";
      const bool any = all.trials > 0;
      row.push_back(any ? text : "-");
      row.push_back(any ? number(median(sum.ms), 0) + "; " +
                              number(*std::max_element(sum.ms.begin(), sum.ms.end()), 0)
                        : "-");
    }
    table.add(row);
  }
  table.publish(settings.out);
}

void publish_filtered(const Settings& settings, const Results& results) {
  std::vector<std::string> columns = {"world", "target", "view", "scans", "runs", "lost"};
  append(columns, error_columns);
  append(columns, nees_columns);
  Table table("departures_filtered",
              "Departures, the whole estimator, a target at rest: the filtered pose after so many "
              "scans of 1,000 returns; NEES: 6 expected",
              columns);
  for (const auto& [cell, result] : results) {
    for (const auto& [scans, errors] : result.filtered) {
      std::vector<std::string> row = {cell.world->name,
                                      cell.sighting->target,
                                      cell.sighting->view,
                                      std::to_string(scans),
                                      std::to_string(errors.count()),
                                      share(errors.refused, errors.count())};
      append(row, cells_of(errors));
      append(row, nees_of(errors));
      table.add(row);
    }
  }
  table.publish(settings.out);
}

/// Of which worlds together the reliability is shown.
std::string reliability_group(const Settings& settings, const Departures& world) {
  const std::vector<Departures>& all = departure_worlds(settings.config);
  if (world.name == all.front().name) return world.name;
  return world.name == all.back().name ? world.name : "one departure";
}

void publish_reliability(const Settings& settings, const Results& results) {
  std::map<std::string, Reliability> groups;
  std::vector<std::string> order;
  for (const auto& [cell, result] : results) {
    if (cell.filtered || cell.world->another) continue;
    const std::string group = reliability_group(settings, *cell.world) + ", " + cell.sighting->view;
    if (groups.count(group) == 0) order.push_back(group);
    groups[group].add(result.reliability);
  }
  Table table("departures_reliability",
              "Probabilities that acquisition gave to hypotheses (of scans that it did not call "
              "lost), and how many of these were right; error: mean distance of the two",
              {"world", "error", "stated", "hypotheses", "mean stated", "right"});
  Figure figure("departures_reliability", 640, 640);
  figure.line(
      "set xlabel 'stated probability'\nset ylabel 'share that is right'\nset xrange [0:1]\n"
      "set yrange [0:1]\nset key bottom right\nset size square\nset grid");
  std::string plot = "plot x with lines lc rgb '#909090' dt 2 title 'honest'";
  for (std::size_t g = 0; g < order.size(); ++g) {
    const Reliability& reliability = groups[order[g]];
    std::vector<std::vector<double>> rows;
    for (const Reliability::Bin& bin : reliability.bins()) {
      if (bin.count == 0) continue;
      table.add({order[g], number(reliability.calibration_error(), 3),
                 number(bin.low, 2) + " to " + number(bin.high, 2), std::to_string(bin.count),
                 number(bin.stated(), 3), share(bin.came_true, bin.count)});
      const Bounds interval = wilson(bin.came_true, bin.count);
      rows.push_back({bin.stated(), bin.observed(), interval.low, interval.high});
    }
    if (rows.empty()) continue;
    const std::string block = "g" + std::to_string(g);
    figure.data(block, rows);
    plot += ", $" + block + " with yerrorlines lc rgb '" + colour_of(g) + "' pt 7 ps 0.6 title '" +
            order[g] + "'";
  }
  figure.line(plot);
  table.publish(settings.out);
  figure.draw(settings.out);
}

/// Errors and how honest they are, over how far the surface is from the mesh.
void draw_surface(const Settings& settings, const Results& results) {
  std::map<std::string, std::map<double, CellResult>> curves;
  for (const auto& [cell, result] : results) {
    if (cell.world->blanket == 0 || cell.filtered || cell.returns != 1000) continue;
    const std::string& view = cell.sighting->view;
    if (view != "held") curves[view][1e3 * cell.world->blanket].add(result);
  }
  if (curves.empty()) return;
  Figure figure("departures_surface", 900, 420);
  figure.line(
      "set multiplot layout 1,2\nset xlabel 'surface off, mm (1 sigma)'\nset logscale xy\n"
      "set xrange [1.5:22]\nset xtics (2,4,8,16)\nset grid\nset key top left");
  std::string errors = "set ylabel 'error, mm (median; ICP dashed)'\nplot ";
  std::string consistency =
      "set ylabel 'mean NEES'\nset yrange [1:100]\nplot 6 with lines lc rgb "
      "'#909090' dt 2 title 'honest'";
  std::size_t c = 0;
  for (const auto& [view, by_sigma] : curves) {
    std::vector<std::vector<double>> rows;
    for (const auto& [sigma, result] : by_sigma) {
      const std::vector<double>& nees = result.tracking.nees;
      if (nees.empty()) continue;
      const Bounds interval = bootstrap(nees, mean);
      rows.push_back({sigma, median(result.tracking.mm), median(result.reference.mm), mean(nees),
                      interval.low, interval.high});
    }
    figure.data(view, rows);
    const std::string colour = std::string("lc rgb '") + colour_of(c++) + "'";
    errors += "$" + view + " using 1:2 with linespoints pt 7 ps 0.6 " + colour + " title '" + view +
              "', $" + view + " using 1:3 with lines dt 2 " + colour + " notitle, ";
    consistency += ", $" + view + " using 1:4:5:6 with yerrorlines pt 7 ps 0.6 " + colour +
                   " title '" + view + "'";
  }
  figure.line(errors + "\n" + consistency + "\nunset multiplot");
  figure.draw(settings.out);
}

/// By name or path; foreign meshes are looked for in the folder of meshes.
std::vector<std::string> targets_of(const Settings& settings) {
  std::vector<std::string> selected = settings.targets;
  if (selected.empty()) selected = {"radarsat2", "shuttle_42.ply", "mgs_shrox.ply"};
  std::vector<std::string> found;
  for (const std::string& name : selected) {
    const std::filesystem::path mesh = settings.meshes / name;
    if (!settings.meshes.empty() && std::filesystem::is_regular_file(mesh)) {
      found.push_back(mesh.string());
    } else if (settings.targets.empty() && std::filesystem::path(name).has_extension()) {
      std::printf("departures: %s skipped, BERTH_TARGETS names no folder that holds it\n",
                  name.c_str());
    } else {
      found.push_back(name);
    }
  }
  return found;
}

Sighting sighting_of(const Settings& settings, const std::string& target, const char* view) {
  Sighting sighting;
  sighting.view = view;
  const bool held = sighting.view == "held";
  const bool is_described = sighting.view == "described";
  sighting.scenes = std::make_shared<SceneMaker>(settings.config, target, held);
  const Target& there = sighting.scenes->target();
  sighting.target = there.name;
  const auto compiled = [&](const Target& modelled) {
    return estimator::load_target_model(modelled, settings.options.model,
                                        estimator::default_cache_directory());
  };
  if (is_described) {
    for (const Departures& world : departure_worlds(settings.config)) {
      auto& model = sighting.described[surface_sigma(world)];
      if (model != nullptr) continue;
      model = compiled(described(there, settings.stated_sigma * surface_sigma(world)));
    }
  } else {
    sighting.model = compiled(bare(there));
    if (settings.acquisition_methods.front() != no_method) {
      sighting.judge = std::make_shared<PoseJudge>(*sighting.model);
    }
  }
  sighting.points = points_on(there.mesh, reference_points, Random(settings.seed, "registration"));
  return sighting;
}

std::vector<Sighting> sightings_of(const Settings& settings) {
  constexpr std::array views = {"free", "held", "described"};
  std::vector<std::pair<std::string, const char*>> selected;
  for (const std::string& target : targets_of(settings)) {
    for (const char* view : views) selected.emplace_back(target, view);
  }
  return results_of("targets", static_cast<int>(selected.size()), settings.untimed_jobs,
                    [&](int i) {
                      const auto& [target, view] = selected[static_cast<std::size_t>(i)];
                      return sighting_of(settings, target, view);
                    });
}

/// The next of those seen the same way; none: null.
const Sighting* another_than(const Sighting& sighting, const std::vector<Sighting>& sightings) {
  const auto here = static_cast<std::size_t>(&sighting - sightings.data());
  for (std::size_t i = 1; i < sightings.size(); ++i) {
    const Sighting& other = sightings[(here + i) % sightings.size()];
    if (other.view == sighting.view && other.target != sighting.target) return &other;
  }
  return nullptr;
}

std::vector<Cell> all_cells(const Settings& settings, const std::vector<Sighting>& sightings) {
  std::vector<Cell> cells;
  for (const Departures& world : departure_worlds(settings.config)) {
    for (const Sighting& sighting : sightings) {
      if (world.once && sighting.view == "held") continue;
      const Sighting* seen = world.another ? another_than(sighting, sightings) : &sighting;
      if (seen == nullptr || (world.another && !sighting.is_acquired())) continue;
      for (const int returns : {200, 1000, 3000, 10000, 50000}) {
        const bool once = !sighting.is_acquired() || world.once;
        if (once && returns != 1000) continue;
        cells.push_back({&sighting, seen, &world, returns});
      }
      if (!world.once) cells.push_back({&sighting, seen, &world, 1000, true});
    }
  }
  std::erase_if(cells, [&](const Cell& c) { return !settings.is_selected(c.name() + " "); });
  if (settings.tracking_methods.front() == no_method) {
    std::erase_if(cells, [](const Cell& c) { return c.filtered || !c.sighting->is_acquired(); });
  }
  return cells;
}

}  // namespace

int run_departures(const Settings& settings) {
  const std::vector<Sighting> sightings = sightings_of(settings);
  const std::vector<Cell> cells = all_cells(settings, sightings);
  // The longest first, so that no thread is left alone with one at the end.
  std::vector<std::size_t> order(cells.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&cells](std::size_t a, std::size_t b) {
    return cells[a].returns > cells[b].returns;
  });
  const auto done = results_of(
      "departures", static_cast<int>(cells.size()), settings.untimed_jobs,
      [&](int i) { return run_cell(settings, cells[order[static_cast<std::size_t>(i)]]); });
  Results results(cells.size());
  for (std::size_t i = 0; i < order.size(); ++i) results[order[i]] = {cells[order[i]], done[i]};
  publish_single(settings, results);
  publish_tracking(settings, results);
  publish_acquisition(settings, results);
  publish_filtered(settings, results);
  publish_reliability(settings, results);
  draw_surface(settings, results);
  return 0;
}

}  // namespace berth::benchmark
