// SPDX-License-Identifier: BSD-3-Clause
// Target 1: acquisition from one scan, without any prior.
#include <algorithm>
#include <cmath>

#include "test/benchmarks/cpu_time.h"
#include "test/benchmarks/judge_likelihood.h"
#include "test/benchmarks/settings.h"
#include "test/benchmarks/table.h"
#include "test/benchmarks/trials.h"

namespace berth::benchmark {
namespace {

using estimator::AcquisitionResult;

enum class Clutter { none, scattered, solid };

struct Cell {
  std::string target;
  int returns = 0;
  Clutter clutter = Clutter::none;
  double least_right = 0;      ///< target
  double most_median_ms = 10;  ///< target
  bool judge_evidence = false;

  std::string name() const {
    const char* kinds[] = {"", " scattered clutter", " solid clutter"};
    return std::filesystem::path(target).stem().string() + " " + std::to_string(returns) +
           kinds[static_cast<int>(clutter)];
  }
};

std::vector<Cell> cells_of(const Settings& settings, const std::string& target) {
  std::vector<Cell> all;
  const bool replica = target == "radarsat2";
  for (const int returns : {3000, 1000, 500, 200, 100, 50}) {
    if (!replica && returns < 100) continue;
    Cell cell{target, returns};
    cell.least_right = replica ? (returns >= 100 ? 0.995 : 0.985)
                               : (returns >= 500   ? 0.99
                                  : returns >= 200 ? 0.97
                                                   : 0.92);
    if (replica && returns == 3000) cell.most_median_ms = 5;
    cell.judge_evidence = replica && returns == 3000;
    all.push_back(cell);
  }
  for (const int returns : {3000, 500}) {
    for (const Clutter kind : {Clutter::scattered, Clutter::solid}) {
      if (replica) all.push_back({target, returns, kind, 0.97, 10, false});
    }
  }
  std::erase_if(all, [&](const Cell& c) { return !settings.wanted(c.name() + " "); });
  return all;
}

enum class Verdict { right, ambiguous_with_truth, ambiguous_without, silently_wrong, lost };

struct Outcome {
  Verdict verdict = Verdict::lost;
  double cpu_ms = 0;
  double lead = std::nan("");  ///< of the truth's log-likelihood; NaN when not asked for
  std::string reason;
};

Verdict verdict_on(const AcquisitionResult& result, const PoseJudge& judge, const Pose& truth) {
  const auto& found = result.hypotheses;
  if (result.status == AcquisitionResult::Status::found) {
    return judge.right(truth, found.front().pose) ? Verdict::right : Verdict::silently_wrong;
  }
  if (result.status != AcquisitionResult::Status::ambiguous) return Verdict::lost;
  const auto end = found.begin() + std::min<std::ptrdiff_t>(4, std::ssize(found));
  return std::any_of(found.begin(), end, [&](const auto& h) { return judge.right(truth, h.pose); })
             ? Verdict::ambiguous_with_truth
             : Verdict::ambiguous_without;
}

/// A plate somewhere in the window, sensor frame, on which about a fifth of the returns fall.
Mesh plate_in(const Window& window, double fill, Random& random) {
  const double share = std::sqrt(0.25 * fill);
  const double range = random.uniform(3.8, 6.5);
  const double azimuth = window.azimuth + random.uniform(-0.5, 0.5) * window.width * (1 - share);
  const double elevation =
      window.elevation + random.uniform(-0.5, 0.5) * window.height * (1 - share);
  Mesh plate;
  plate.append(make_box({share * window.width * range, share * window.height * range, 0.05}),
               {range * beam_direction(azimuth, elevation), Quaterniond::Identity()});
  return plate;
}

Outcome run_trial(const Settings& settings, const Cell& cell, const estimator::Acquisition& method,
                  const estimator::TargetModel& model, const PoseJudge& judge, int index) {
  Random random(settings.seed, "acquisition " + cell.name() + " " + std::to_string(index));
  Physics physics;
  physics.noise.range_min_m = 1;  // a cube of 3 m comes near
  if (cell.clutter == Clutter::scattered) physics.clutter = 0.2;
  Pose truth{{0, 0, 5}, random.rotation()};
  for (int i = 0; i < 2; ++i) truth.position[i] = random.uniform(-0.1, 0.1);
  truth.position += truth.position - truth * model.centre;  // its middle, wherever its origin is
  truth.position.z() += 5 - (truth * model.centre).z();
  const World empty(model.target.mesh, physics, random);
  std::vector<Window> windows = {window_around(model.target.mesh, truth, 0.05)};
  windows.front().count = 2000;
  const double fill = empty.expected_returns(windows, truth) / 2000;
  windows = scaled_to_returns(empty, windows, truth, cell.returns);
  const World world =
      cell.clutter == Clutter::solid
          ? World(model.target.mesh, physics, random, plate_in(windows.front(), fill, random))
          : World(model.target.mesh, physics, random);
  const Scan scan = world.sweep(windows, truth, random);

  Outcome outcome;
  const double start = cpu_ms();
  const AcquisitionResult result =
      method.acquire(estimator::preprocess(scan.beams, {1, 15}, physics.noise));
  outcome.cpu_ms = cpu_ms() - start;
  outcome.verdict = verdict_on(result, judge, truth);
  outcome.reason = result.reason;
  const bool failed =
      outcome.verdict != Verdict::right && outcome.verdict != Verdict::ambiguous_with_truth;
  if (cell.clutter == Clutter::none && (cell.judge_evidence || failed)) {
    std::vector<Pose> hypotheses;
    for (const auto& h : result.hypotheses) hypotheses.push_back(h.pose);
    outcome.lead = JudgeLikelihood(world.caster(), physics.noise)
                       .lead(scan.beams, truth, judge, hypotheses, random);
  }
  return outcome;
}

void report(const std::string& method, const Cell& cell, const std::vector<Outcome>& outcomes,
            Table& table, std::vector<std::vector<std::string>>& failures) {
  const auto n = static_cast<int>(outcomes.size());
  const auto count = [&](auto&& condition) {
    return static_cast<int>(std::count_if(outcomes.begin(), outcomes.end(), condition));
  };
  const auto with = [&](Verdict v) {
    return count([v](const Outcome& o) { return o.verdict == v; });
  };
  constexpr const char* names[] = {"right", "ambiguous with truth", "ambiguous without truth",
                                   "silently wrong", "lost"};
  std::vector<double> times;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    times.push_back(outcomes[i].cpu_ms);
    if (outcomes[i].verdict == Verdict::right ||
        outcomes[i].verdict == Verdict::ambiguous_with_truth) {
      continue;
    }
    failures.push_back({method, cell.name(), std::to_string(i),
                        names[static_cast<int>(outcomes[i].verdict)], number(outcomes[i].lead, 1),
                        outcomes[i].reason});
  }
  const int right = with(Verdict::right) + with(Verdict::ambiguous_with_truth);
  const int wrong = with(Verdict::silently_wrong);
  const int decisive = count([](const Outcome& o) { return o.lead > 5; });
  const int decided =
      count([](const Outcome& o) { return o.lead > 5 && o.verdict == Verdict::right; });
  const bool enough = !cell.judge_evidence || decided >= 0.95 * decisive;
  table.judge(
      {method, cell.name(), share(right, n), std::to_string(with(Verdict::right)),
       std::to_string(with(Verdict::ambiguous_with_truth)),
       std::to_string(with(Verdict::ambiguous_without)), share(wrong, n),
       std::to_string(with(Verdict::lost)),
       cell.judge_evidence ? share(decided, decisive) + " of " + std::to_string(decisive) : "",
       number(median(times)), number(percentile(times, 0.95)),
       ">= " + number(100 * cell.least_right, 1) + " %, <= " + number(cell.most_median_ms, 0) +
           " ms"},
      right >= cell.least_right * n && wrong <= 0.002 * n && median(times) <= cell.most_median_ms &&
          enough);
}

std::vector<std::string> targets_of(const Settings& settings) {
  std::vector<std::string> targets;
  if (!settings.meshes.empty()) {
    for (const auto& entry : std::filesystem::directory_iterator(settings.meshes)) {
      const auto extension = entry.path().extension();
      if (extension == ".ply" || extension == ".stl" || extension == ".obj") {
        targets.push_back(entry.path().string());
      }
    }
  }
  std::sort(targets.begin(), targets.end());
  targets.insert(targets.begin(), "radarsat2");
  return targets;
}

}  // namespace

int run_acquisition(const Settings& settings) {
  Table table("acquisition",
              "Acquisition, random attitude at 5 m, 10 mm and 0.1 mrad, misses reported, " +
                  std::to_string(settings.trials) +
                  " trials a row; silently wrong at most 0.2 %; decided: of the trials with "
                  "decisive evidence, at least 95 %",
              {"method", "target, returns", "right or ambiguous with truth", "right", "ambiguous",
               "without truth", "silently wrong", "lost", "decided", "median ms", "p95 ms",
               "wanted", "target"});
  std::vector<std::vector<std::string>> failures;
  for (const std::string& target : targets_of(settings)) {
    const std::vector<Cell> cells = cells_of(settings, target);
    if (cells.empty()) continue;
    const auto model = model_of(settings, target);
    const PoseJudge judge(*model);
    std::printf("%s: attitudes that show the same surface: %zu\n", model->target.name.c_str(),
                judge.symmetries());
    for (const std::string& name : settings.acquisition_methods) {
      const auto subject = acquisition_named(settings, name, model, Physics().noise);
      for (const Cell& cell : cells) {
        const auto outcomes = results_of(
            "acquisition " + name + " " + cell.name(), settings.trials, settings.jobs,
            [&](int i) { return run_trial(settings, cell, **subject, *model, judge, i); });
        report(name, cell, outcomes, table, failures);
      }
    }
  }
  table.publish(settings.out);
  write_csv(settings.out / "acquisition_failures.csv",
            {"method", "cell", "trial", "verdict", "lead of the truth", "reason"}, failures);
  return table.missed();
}

}  // namespace berth::benchmark
