// SPDX-License-Identifier: BSD-3-Clause
// The hot paths, under Google Benchmark.
#include <benchmark/benchmark.h>

#include "test/benchmarks/settings.h"
#include "test/benchmarks/tracking_trial.h"

namespace berth::benchmark {
namespace {

/// A scan of the replica and all that the hot paths start from.
struct Bench {
  const Settings& settings;
  std::shared_ptr<const estimator::TargetModel> model;
  TrackingTrial trial;
  estimator::PreprocessedScan clean;
  BeamModel noise;

  Bench(const Settings& s, int returns) : settings(s), model(model_of(s)) {
    TrackingCase the_case;
    the_case.whole_target = true;
    the_case.returns = returns;
    trial = make_tracking_trial(*model, the_case, Random(s.seed, "micro"));
    clean = estimator::preprocess(trial.scan.beams, {1, 15}, noise);
  }
};

void cast_rays(::benchmark::State& state, const Settings& settings) {
  const Bench bench(settings, 1000);
  const Pose to_model = bench.trial.truth.inverse();
  RayHit hit;
  for (auto _ : state) {
    for (const estimator::Beam& beam : bench.clean.beams) {
      ::benchmark::DoNotOptimize(bench.model->caster.cast(
          {to_model.position, to_model.rotation * beam.direction}, 100, hit));
    }
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(bench.clean.beams));
}

void nearest_points(::benchmark::State& state, const Settings& settings) {
  const Bench bench(settings, 1000);
  const Pose to_model = bench.trial.truth.inverse();
  for (auto _ : state) {
    for (const Vector3d& p : bench.clean.points) {
      ::benchmark::DoNotOptimize(bench.model->caster.nearest(to_model * p));
    }
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(bench.clean.points));
}

void likelihood(::benchmark::State& state, const Settings& settings) {
  const Bench bench(settings, 1000);
  for (auto _ : state) {
    ::benchmark::DoNotOptimize(
        estimator::beam_likelihood(*bench.model, bench.noise, bench.clean.beams, bench.trial.truth,
                                   1, settings.options.voxel_template.likelihood));
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(bench.clean.beams));
}

void preprocessing(::benchmark::State& state, const Settings& settings) {
  const Bench bench(settings, static_cast<int>(state.range(0)));
  for (auto _ : state) {
    ::benchmark::DoNotOptimize(estimator::preprocess(bench.trial.scan.beams, {1, 15}, bench.noise));
  }
  state.SetItemsProcessed(state.iterations() * std::ssize(bench.trial.scan.beams));
}

void tracking(::benchmark::State& state, const Settings& settings, const std::string& name) {
  const Bench bench(settings, static_cast<int>(state.range(0)));
  const auto subject = tracking_named(settings, name, bench.model, bench.noise);
  for (auto _ : state) {
    ::benchmark::DoNotOptimize((*subject)->track(bench.clean, bench.trial.predicted));
  }
  state.SetItemsProcessed(state.iterations() * state.range(0));
}

void acquisition(::benchmark::State& state, const Settings& settings, const std::string& name) {
  const Bench bench(settings, static_cast<int>(state.range(0)));
  const auto subject = acquisition_named(settings, name, bench.model, bench.noise);
  for (auto _ : state) ::benchmark::DoNotOptimize((*subject)->acquire(bench.clean));
}

void planning(::benchmark::State& state, const Settings& settings,
              estimator::ScanStrategy strategy) {
  const Bench bench(settings, 200);
  const estimator::PlannerOptions options;
  const estimator::ScanPlanner planner(*bench.model, {}, options);
  for (auto _ : state) {
    ::benchmark::DoNotOptimize(planner.plan(bench.trial.truth, 0.005, strategy, 1000));
  }
}

}  // namespace

int run_micro(const Settings& settings) {
  using ::benchmark::RegisterBenchmark;
  constexpr auto us = ::benchmark::kMicrosecond;
  RegisterBenchmark("cast_rays", cast_rays, settings)->Unit(us);
  RegisterBenchmark("nearest_points", nearest_points, settings)->Unit(us);
  RegisterBenchmark("likelihood", likelihood, settings)->Unit(us);
  RegisterBenchmark("preprocessing", preprocessing, settings)->Arg(1000)->Arg(50000)->Unit(us);
  for (const std::string& name : settings.tracking_methods) {
    RegisterBenchmark(("tracking/" + name).c_str(), tracking, settings, name)
        ->Arg(200)
        ->Arg(1000)
        ->Arg(3000)
        ->Arg(50000)
        ->Unit(us);
  }
  for (const std::string& name : settings.acquisition_methods) {
    RegisterBenchmark(("acquisition/" + name).c_str(), acquisition, settings, name)
        ->Arg(100)
        ->Arg(500)
        ->Arg(3000)
        ->Unit(us);
  }
  for (const auto strategy :
       {estimator::ScanStrategy::corners_sparse, estimator::ScanStrategy::information}) {
    const std::string& name = estimator::scan_strategy_names()[static_cast<std::size_t>(strategy)];
    RegisterBenchmark(("planning/" + name).c_str(), planning, settings, strategy)->Unit(us);
  }
  std::string program = "berth benchmark";
  std::string out = "--benchmark_out=" + (settings.out / "micro.csv").string();
  std::string format = "--benchmark_out_format=csv";
  std::string filter = "--benchmark_filter=";
  for (const std::string& name : settings.only) {
    filter += (name == settings.only.front() ? "" : "|") + name;
  }
  char* arguments[] = {program.data(), out.data(), format.data(), filter.data()};
  int count = settings.only.empty() ? 3 : 4;
  ::benchmark::Initialize(&count, arguments);
  ::benchmark::RunSpecifiedBenchmarks();
  ::benchmark::Shutdown();
  return 0;
}

}  // namespace berth::benchmark
