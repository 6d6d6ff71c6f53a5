// SPDX-License-Identifier: BSD-3-Clause
// The paper's Figures 6 and 7: acquisition against the number of points (section 5.2).
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "evaluation/trials/self_match.h"
#include "evaluation/trials/world.h"
#include "test/benchmarks/figure.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

constexpr int data_sets = 110;      // the paper's
constexpr int dense_beams = 90000;  // 15,000 to 60,000 of them return from the target

struct DataSet {
  Pose truth;
  Scan scan;
};

DataSet make_data_set(const Settings& settings, const estimator::TargetModel& model,
                      const World& world, int index) {
  Random random(settings.seed, "paper acquisition " + std::to_string(index));
  DataSet made;
  made.truth = {{random.uniform(-0.1, 0.1), random.uniform(-0.1, 0.1), 5}, random.rotation()};
  // One density for all: as many beams per square degree whatever the attitude.
  Window window = window_around(model.target.mesh, made.truth, 0.02);
  const double largest = std::pow(2 * std::atan2(model.radius, 5.0), 2);
  window.count = static_cast<int>(4.5 * dense_beams * window.width * window.height / largest);
  made.scan = world.sweep({window}, made.truth, random);
  return made;
}

/// A share of the beams, misses among them, drawn at random.
std::vector<RawBeam> thinned(const std::vector<RawBeam>& beams, double kept, Random& random) {
  std::vector<RawBeam> some;
  for (const RawBeam& beam : beams) {
    if (random.uniform() < kept) some.push_back(beam);
  }
  return some;
}

struct Axis {
  Vector3d centroid = Vector3d::Zero();
  Vector3d direction = Vector3d::UnitX();
};

Axis major_axis(const std::vector<Vector3d>& points) {
  Axis axis;
  const auto n = static_cast<double>(points.size());
  for (const Vector3d& p : points) axis.centroid += p / n;
  Matrix3d covariance = Matrix3d::Zero();
  for (const Vector3d& p : points) {
    covariance += (p - axis.centroid) * (p - axis.centroid).transpose() / n;
  }
  axis.direction = Eigen::SelfAdjointEigenSolver<Matrix3d>(covariance).eigenvectors().col(2);
  return axis;
}

void figure_6(const Settings& settings, const DataSet& data) {
  Figure figure("figure_6", 1200, 420);
  std::vector<std::vector<double>> axes;
  Random random(settings.seed, "figure 6");
  std::string plots;
  for (const int requested : {20000, 3000, 300}) {
    const double kept = std::min(1.0, static_cast<double>(requested) / data.scan.returns);
    std::vector<Vector3d> points;
    std::vector<std::vector<double>> rows;
    for (const RawBeam& beam : thinned(data.scan.beams, kept, random)) {
      if (beam.status != BeamStatus::hit) continue;
      points.push_back(beam.range * beam_direction(beam.azimuth, beam.elevation));
      rows.push_back({points.back().x(), -points.back().y(), points.back().z()});
    }
    const Axis axis = major_axis(points);
    const Vector3d truth = data.truth.rotation * Vector3d::UnitX();
    const double off = degrees(std::acos(std::min(1.0, std::abs(axis.direction.dot(truth)))));
    axes.push_back({static_cast<double>(points.size()), off, axis.direction.x(), axis.direction.y(),
                    axis.direction.z(), truth.x(), truth.y(), truth.z()});
    const std::string name = "p" + std::to_string(requested);
    figure.data(name, rows);
    write_numbers(settings.out / ("figure_6_" + std::to_string(requested) + ".csv"),
                  {"x m", "up m", "z m"}, rows);
    const auto ends = [&](const std::string& block, const Vector3d& direction) {
      const Vector3d a = axis.centroid - 1.7 * direction;
      const Vector3d b = axis.centroid + 1.7 * direction;
      figure.data(block, {{a.x(), -a.y()}, {b.x(), -b.y()}});
    };
    ends("a" + name, axis.direction);
    ends("t" + name, truth);
    plots += "set title '" + std::to_string(points.size()) + " points: " + number(off, 1) +
             " deg off'\nplot $" + name + " using 1:2 with dots lc rgb '#406080' notitle, $t" +
             name + " using 1:2 with lines lw 2 lc rgb '#30a030' title 'true axis', $a" + name +
             " using 1:2 with lines lw 2 lc rgb '#c03030' title 'major axis (PCA)'\n";
  }
  write_numbers(settings.out / "figure_6_axes.csv",
                {"points", "off deg", "x", "y", "z", "true x", "true y", "true z"}, axes);
  figure.line(
      "set multiplot layout 1,3\nset size square\nset xrange [-1.8:1.8]\nset yrange "
      "[-1.8:1.8]\nset grid lc rgb '#e0e0e0'");
  figure.line("set xlabel 'x, m'\nset ylabel 'up, m'\nset key top right");
  figure.line(plots + "unset multiplot");
  figure.draw(settings.out);
}

struct Result {
  int points = 0;
  bool success = false;
  double roll = 0, pitch = 0, yaw = 0;  // deg, about the model's x, y, z
  double mm = 0;
};

/// The pose's error, and success, as the paper reports them: the failures are flips of the target's
/// near symmetries and views that determine nothing.
Result result_of(const estimator::Acquisition& method, const BeamModel& noise,
                 const PoseJudge& judge, const DataSet& data, double kept, Random random) {
  const std::vector<RawBeam> beams = thinned(data.scan.beams, kept, random);
  const estimator::PreprocessedScan clean = estimator::preprocess(beams, {1, 15}, noise);
  Result r;
  r.points = static_cast<int>(clean.points.size());
  const auto found = method.acquire(clean);
  if (found.hypotheses.empty()) return r;
  const Pose& pose = found.hypotheses.front().pose;
  const Pose truth = judge.nearest_equal(data.truth, pose);
  if (angle_between(truth, pose) > radians(45)) return r;
  r.success = true;
  const Vector3d error = rotation_vector(truth.rotation.conjugate() * pose.rotation);
  r.roll = degrees(std::abs(error.x()));
  r.pitch = degrees(std::abs(error.y()));
  r.yaw = degrees(std::abs(error.z()));
  r.mm = 1e3 * distance(truth, pose);
  return r;
}

void figure_7(const Settings& settings, const estimator::TargetModel& model,
              const std::vector<DataSet>& sets) {
  const PoseJudge judge(model);
  Table table(
      "figure_7",
      "Figure 7: acquisition of " + std::to_string(sets.size()) +
          " data sets at 5 m, resampled; average errors of successful runs. The paper: "
          "'almost constant for more than 2,000 samples and significantly increase for less "
          "than 500'; its axes end at 20 deg and 50 mm; the curves are not in its text",
      {"method", "discarded", "mean points", "success", "roll deg", "pitch deg", "yaw deg",
       "translation mm"});
  Figure figure("figure_7", 1100, 450);
  std::string angles;
  std::string errors;
  int count = 0;
  for (const std::string& name : settings.acquisition_methods) {
    const auto subject = acquisition_named(settings, name, model_of(settings), BeamModel());
    std::vector<std::vector<double>> rows;
    for (const double discarded : {0.1, 0.3, 0.5, 0.7, 0.8, 0.9, 0.93, 0.95, 0.97, 0.98, 0.99,
                                   0.995, 0.998, 0.999, 0.9999}) {
      const std::string label = number(100 * discarded, 2) + " %";
      const auto results =
          results_of("figure 7 " + name + " " + label, static_cast<int>(sets.size()), settings.jobs,
                     [&](int i) {
                       const Random random(settings.seed, "figure 7 " + label + std::to_string(i));
                       return result_of(**subject, subject->noise, judge,
                                        sets[static_cast<std::size_t>(i)], 1 - discarded, random);
                     });
      Result mean;
      double points = 0;
      int successes = 0;
      for (const Result& r : results) {
        points += r.points;
        if (!r.success) continue;
        ++successes;
        mean.roll += r.roll;
        mean.pitch += r.pitch;
        mean.yaw += r.yaw;
        mean.mm += r.mm;
      }
      points /= static_cast<double>(results.size());
      const double n = successes;
      rows.push_back({points, n / static_cast<double>(results.size()), mean.roll / n,
                      mean.pitch / n, mean.yaw / n, mean.mm / n});
      const auto& row = rows.back();
      table.add({name, label, number(points, 0), share(successes, static_cast<int>(results.size())),
                 number(row[2]), number(row[3]), number(row[4]), number(row[5], 1)});
    }
    const std::string block = "m" + std::to_string(count);
    figure.data(block, rows);
    const std::string marks = " with linespoints pt " + std::to_string(count == 0 ? 7 : 4) +
                              " ps 0.5 dt " + std::to_string(count + 1);
    constexpr const char* colours[] = {"#c03030", "#30a030", "#3060c0"};
    constexpr const char* names[] = {"roll", "pitch", "yaw"};
    for (int i = 0; i < 3; ++i) {
      angles += (angles.empty() ? "plot $" : ", $") + block + " using 1:" + std::to_string(3 + i) +
                marks + " lc rgb '" + colours[i] + "' title '" + name + ", " + names[i] + "'";
    }
    errors += (errors.empty() ? "plot $" : ", $") + block + " using 1:6" + marks +
              " lc rgb '#404040' title '" + name + "'";
    ++count;
  }
  table.publish(settings.out);
  figure.line(
      "set multiplot layout 1,2\nset grid lc rgb '#e0e0e0'\nset logscale x\nset key noenhanced");
  figure.line("set xlabel 'number of points'\nset yrange [0:*]");
  figure.line("set title 'average angular error'\nset ylabel 'deg'\n" + angles);
  figure.line("set title 'average translation error'\nset ylabel 'mm'\n" + errors);
  figure.line("unset multiplot");
  figure.draw(settings.out);
}

}  // namespace

int run_paper_acquisition(const Settings& settings) {
  const auto model = model_of(settings);
  const World world(model->target.mesh, {}, Random(settings.seed, "paper"));
  const auto sets = results_of("data sets", data_sets, settings.jobs,
                               [&](int i) { return make_data_set(settings, *model, world, i); });
  // One that shows the target broadside.
  figure_6(settings, *std::max_element(sets.begin(), sets.end(), [](const auto& a, const auto& b) {
             return a.scan.returns < b.scan.returns;
           }));
  figure_7(settings, *model, sets);
  return 0;
}

}  // namespace berth::benchmark
