// SPDX-License-Identifier: BSD-3-Clause
// Target 1: acquisition from one scan, without any prior.
#include <algorithm>
#include <cmath>

#include "common/core/file.h"
#include "evaluation/trials/acquisition_trial.h"
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
  double min_right = 0;       ///< target
  double max_median_ms = 10;  ///< target
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
    cell.min_right = replica ? (returns >= 100 ? 0.995 : 0.985)
                             : (returns >= 500   ? 0.99
                                : returns >= 200 ? 0.97
                                                 : 0.92);
    if (replica && returns == 3000) cell.max_median_ms = 5;
    cell.judge_evidence = replica && returns == 3000;
    all.push_back(cell);
  }
  for (const int returns : {3000, 500}) {
    for (const Clutter kind : {Clutter::scattered, Clutter::solid}) {
      if (replica) all.push_back({target, returns, kind, 0.97, 10, false});
    }
  }
  std::erase_if(all, [&](const Cell& c) { return !settings.is_selected(c.name() + " "); });
  return all;
}

struct Outcome {
  Verdict verdict = Verdict::lost;
  double cpu_ms = 0;
  double lead = std::nan("");  ///< of the truth's log-likelihood; NaN when not requested
  std::string reason;
};

Outcome run_trial(const Settings& settings, const Cell& cell, const estimator::Acquisition& method,
                  const std::shared_ptr<const estimator::TargetModel>& model,
                  const PoseJudge& judge, int index) {
  Random random(settings.seed, "acquisition " + cell.name() + " " + std::to_string(index));
  SceneWishes wishes;
  Physics& physics = wishes.physics;
  physics.noise.range_min_m = 1;  // a cube of 3 m comes near
  if (cell.clutter == Clutter::scattered) physics.clutter = 0.2;
  wishes.returns = cell.returns;
  wishes.attitude = random.rotation();
  for (int i = 0; i < 2; ++i) wishes.middle[i] = random.uniform(-0.1, 0.1);
  wishes.plate = cell.clutter == Clutter::solid;
  const AcquisitionScene scene = make_scene(model, wishes, random);
  const Scan& scan = scene.scan;

  Outcome outcome;
  const double start = cpu_ms();
  const AcquisitionResult result =
      method.acquire(estimator::preprocess(scan.beams, {1, 15}, physics.noise));
  outcome.cpu_ms = cpu_ms() - start;
  outcome.verdict = verdict_on(result, judge, scene.truth);
  outcome.reason = result.reason;
  const bool failed = !has_truth(outcome.verdict);
  if (cell.clutter == Clutter::none && (cell.judge_evidence || failed)) {
    std::vector<Pose> hypotheses;
    for (const auto& h : result.hypotheses) hypotheses.push_back(h.pose);
    outcome.lead = JudgeLikelihood(scene.world.caster(), physics.noise)
                       .lead(scan.beams, scene.truth, judge, hypotheses, random);
  }
  return outcome;
}

void report(const Yardstick& yardstick, const std::string& method, const Cell& cell,
            const std::vector<Outcome>& outcomes, Table& table,
            std::vector<berth::Table::Row>& failures) {
  const auto n = static_cast<int>(outcomes.size());
  const auto count = [&](auto&& condition) {
    return static_cast<int>(std::count_if(outcomes.begin(), outcomes.end(), condition));
  };
  const auto with = [&](Verdict v) {
    return count([v](const Outcome& o) { return o.verdict == v; });
  };
  std::vector<double> times;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    times.push_back(outcomes[i].cpu_ms);
    if (has_truth(outcomes[i].verdict)) continue;
    failures.push_back({method, cell.name(), std::to_string(i), name_of(outcomes[i].verdict),
                        number(outcomes[i].lead, 1), outcomes[i].reason});
  }
  const int right = with(Verdict::right) + with(Verdict::ambiguous_with_truth);
  const int wrong = with(Verdict::silently_wrong);
  const int decisive = count([](const Outcome& o) { return o.lead > 5; });
  const int decided =
      count([](const Outcome& o) { return o.lead > 5 && o.verdict == Verdict::right; });
  const bool enough = !cell.judge_evidence || yardstick.share_at_least(decided, decisive, 0.95);
  table.judge(
      {method, cell.name(), share(right, n), std::to_string(with(Verdict::right)),
       std::to_string(with(Verdict::ambiguous_with_truth)),
       std::to_string(with(Verdict::ambiguous_without)), share(wrong, n),
       std::to_string(with(Verdict::lost)),
       cell.judge_evidence ? share(decided, decisive) + " of " + std::to_string(decisive) : "",
       number(median(times)), number(quantile(times, 0.95)),
       ">= " + number(100 * cell.min_right, 1) + " %, <= " + number(cell.max_median_ms, 0) + " ms"},
      yardstick.share_at_least(right, n, cell.min_right) &&
          yardstick.share_at_most(wrong, n, 0.002) &&
          yardstick.milliseconds_at_most(median(times), cell.max_median_ms) && enough);
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
  std::vector<berth::Table::Row> failures;
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
            [&](int i) { return run_trial(settings, cell, **subject, model, judge, i); });
        report(settings.yardstick, name, cell, outcomes, table, failures);
      }
    }
  }
  table.publish(settings.out);
  write_file(
      settings.out / "acquisition_failures.csv",
      csv_table(
          {"", {"method", "cell", "trial", "verdict", "lead of the truth", "reason"}, failures}));
  return table.missed();
}

}  // namespace berth::benchmark
