// SPDX-License-Identifier: BSD-3-Clause
// Target 8: how cost grows with returns and with the model's triangles.
#include <cmath>
#include <fstream>

#include "test/benchmarks/cpu_time.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/tracking_trial.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

/// 96 triangles without symmetry: body, wings, boom, dish and boxes.
Mesh box_satellite() {
  Mesh mesh;
  const auto add = [&mesh](const Vector3d& size, const Vector3d& at) {
    mesh.append(make_box(size), {at, Quaterniond::Identity()});
  };
  add({0.8, 0.7, 0.6}, {0, 0, 0});
  add({1.1, 0.5, 0.03}, {0.95, 0.05, 0.1});
  add({1.0, 0.5, 0.03}, {-0.90, 0.05, 0.1});
  add({0.06, 0.9, 0.06}, {0.2, -0.8, 0.1});
  add({0.4, 0.04, 0.4}, {0.2, -1.25, 0.1});
  add({0.2, 0.2, 0.25}, {-0.2, 0.1, -0.42});
  add({0.1, 0.15, 0.1}, {0.3, 0.42, 0.2});
  add({0.3, 0.1, 0.1}, {0.1, -0.1, 0.35});
  return mesh;
}

/// The same surface with four times the triangles.
Mesh subdivided(const Mesh& mesh) {
  Mesh fine;
  for (const auto& t : mesh.triangles) {
    const auto first = static_cast<std::uint32_t>(fine.vertices.size());
    const Vector3d& a = mesh.vertices[t[0]];
    const Vector3d& b = mesh.vertices[t[1]];
    const Vector3d& c = mesh.vertices[t[2]];
    for (const Vector3d& v :
         {a, b, c, Vector3d(0.5 * (a + b)), Vector3d(0.5 * (b + c)), Vector3d(0.5 * (c + a))}) {
      fine.vertices.push_back(v);
    }
    for (const std::array<std::uint32_t, 3>& part :
         {std::array<std::uint32_t, 3>{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}) {
      fine.triangles.push_back({first + part[0], first + part[1], first + part[2]});
    }
  }
  return fine;
}

/// Peak resident memory since the last call, MB.
double peak_megabytes() {
  double kilobytes = 0;
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    if (word == "VmHWM:") status >> kilobytes;
  }
  std::ofstream("/proc/self/clear_refs") << "5";
  return kilobytes / 1024;
}

TrackingCase case_of(int returns) {
  TrackingCase the_case;
  the_case.physics.noise = table_1_noise(1);
  the_case.whole_target = true;
  the_case.returns = returns;
  return the_case;
}

std::string count(double value) { return number(value, 0); }

struct Times {
  double track = 0;
  double acquire = 0;
};

/// Median CPU times over a few scans.
Times times_of(const Settings& settings, std::shared_ptr<const estimator::TargetModel> model,
               int returns, int trials, const std::string& tracking,
               const std::string& acquisition) {
  const TrackingCase the_case = case_of(returns);
  const auto tracker = tracking_named(settings, tracking, model, the_case.physics.noise);
  const auto finder = acquisition_named(settings, acquisition, model, the_case.physics.noise);
  std::vector<double> track_ms;
  std::vector<double> acquire_ms;
  terminal::ProgressLine progress("trials of scaling " + count(returns) + " returns", trials);
  for (int i = 0; i < trials; ++i) {
    const Random random(settings.seed, "scaling " + std::to_string(i));
    const TrackingTrial trial = make_tracking_trial(*model, the_case, random);
    track_ms.push_back(track(**tracker, tracker->noise, trial).cpu_ms);
    const auto clean = estimator::preprocess(trial.scan.beams, {1, 15}, finder->noise);
    const double start = cpu_ms();
    (*finder)->acquire(clean);
    acquire_ms.push_back(cpu_ms() - start);
    progress.show(i + 1);
  }
  return {median(track_ms), median(acquire_ms)};
}

void against_returns(const Settings& settings, const std::string& tracking,
                     const std::string& acquisition) {
  const auto model = model_of(settings);
  Table table("scaling_returns", "Cost against returns, replica: " + tracking + ", " + acquisition,
              {"returns", "track ms", "us a return", "acquire ms"});
  std::vector<double> x;
  std::vector<double> y;
  for (const int returns : {50, 200, 1000, 5000, 20000, 100000, 300000, 1000000}) {
    const int trials = std::min(settings.trials, returns <= 5000 ? 50 : returns <= 20000 ? 20 : 5);
    const Times t = times_of(settings, model, returns, trials, tracking, acquisition);
    table.add({count(returns), number(t.track, 3), number(1e3 * t.track / returns, 3),
               number(t.acquire, 2)});
    if (returns >= 1000) {
      x.push_back(returns);
      y.push_back(t.track);
    }
  }
  table.add({"growth", "returns^" + number(growth_exponent(x, y)), "", ""});
  table.publish(settings.out);
}

void against_triangles(const Settings& settings, const std::string& tracking,
                       const std::string& acquisition) {
  Table table("scaling_triangles",
              "Cost against triangles, one shape ever finer: " + tracking + ", " + acquisition,
              {"triangles", "compile s", "track 1,000 ms", "acquire 1,000 ms", "peak MB"});
  std::vector<double> x;
  std::vector<double> y;
  Target target;
  target.name = "box_satellite";
  target.mesh = scaled_to_length(box_satellite(), 3);
  target.length = 3;
  peak_megabytes();
  for (int level = 0; level < 6; ++level) {
    if (level > 0) target.mesh = subdivided(target.mesh);
    target.hash = content_hash(target.mesh);
    const double start = cpu_ms();
    const auto model = estimator::compile_target_model(target, settings.options.model);
    const double compile = cpu_ms() - start;
    const Times t =
        times_of(settings, model, 1000, std::min(settings.trials, 20), tracking, acquisition);
    const auto triangles = static_cast<double>(target.mesh.triangles.size());
    table.add({count(triangles), number(1e-3 * compile, 2), number(t.track, 3),
               number(t.acquire, 2), number(peak_megabytes(), 0)});
    x.push_back(triangles);
    y.push_back(t.track);
  }
  table.add({"growth", "", "triangles^" + number(growth_exponent(x, y)), "", ""});
  table.publish(settings.out);
}

}  // namespace

int run_scaling(const Settings& settings) {
  const std::string& tracking = settings.tracking_methods.front();
  const std::string& acquisition = settings.acquisition_methods.front();
  if (settings.is_selected("returns ")) against_returns(settings, tracking, acquisition);
  if (settings.is_selected("triangles ")) against_triangles(settings, tracking, acquisition);
  return 0;
}

}  // namespace berth::benchmark
