// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/check/criteria_check.h"

#include <algorithm>
#include <cmath>

#include "common/core/text.h"
#include "evaluation/measure/safety.h"
#include "evaluation/run/target_surface.h"
#include "procedures/check/recording.h"

namespace berth::procedures {
namespace {

std::string in_unit(double value, const std::string& unit) {
  return fixed(value, 2) + (unit.empty() ? "" : " " + unit);
}

/// The limits as an operator would say them.
std::string limits_of(const criterion_result_t& result) {
  std::string text;
  if (std::isfinite(result.lower_limit))
    text = "at least " + in_unit(result.lower_limit, result.unit);
  if (std::isfinite(result.upper_limit)) {
    text += (text.empty() ? "" : " and ") + std::string("at most ") +
            in_unit(result.upper_limit, result.unit);
  }
  return text;
}

class CriteriaCheck {
 public:
  CriteriaCheck(const Procedure& procedure, const Rig& rig, const Rehearsal& rehearsal)
      : procedure_(procedure),
        rig_(rig),
        rehearsal_(rehearsal),
        record_(forecast_record(rig, rehearsal, true)),
        truth_alone_(forecast_record(rig, rehearsal, false)),
        measurer_(record_, evaluation::nearest_point_on(rig.cell.target)),
        truth_measurer_(truth_alone_, evaluation::nearest_point_on(rig.cell.target)) {}

  std::vector<Finding> run() {
    for (const evaluation::Criterion& criterion : procedure_.criteria) look_at(criterion);
    return std::move(findings_);
  }

 private:
  void add(const evaluation::Criterion& criterion, Severity severity, const std::string& found,
           const std::string& expected = "") {
    findings_.push_back({severity, procedure_.file, criterion.line,
                         "criterion '" + criterion.name + "'", found, expected, -1});
  }

  bool anything_tracked(const std::string& phase_name) const {
    const auto phase = record_.phase(phase_name);
    return phase && std::any_of(record_.estimates().begin(), record_.estimates().end(),
                                [&](const auto& e) { return phase->contains(e.utime); });
  }

  template <class Doubtful>
  bool none_of_phase(const std::string& phase, Doubtful doubtful) const {
    const auto& steps = rehearsal_.steps();
    return std::none_of(steps.begin(), steps.end(), [&](const StepForecast& step) {
      return doubtful(step) && (phase == evaluation::whole_run || step.phase == phase);
    });
  }

  /// Whether the procedure itself says how long each step of the phase takes.
  bool timed(const std::string& phase) const {
    return none_of_phase(phase, [](const StepForecast& step) { return step.guessed; });
  }

  /// Whether it says where the arms are in it.
  bool foreseen(const std::string& phase) const {
    return none_of_phase(phase, [](const StepForecast& step) { return step.steered; });
  }

  bool anything_injected() const {
    return std::any_of(procedure_.steps.begin(), procedure_.steps.end(),
                       [](const Step& step) { return std::holds_alternative<Inject>(step.verb); });
  }

  void look_at(const evaluation::Criterion& criterion) {
    if (criterion.measurement->family == evaluation::safety_family) {
      // What answers a fault is not foreseen.
      if (anything_injected()) return;
      return add(criterion, Severity::error, "nothing is injected", "an 'inject' before it");
    }
    if (criterion.measurement->of_returns && anything_tracked(criterion.phase)) return;
    const criterion_result_t result = evaluation::judge(criterion, measurer_);
    const criterion_result_t truth = evaluation::judge(criterion, truth_measurer_);
    const bool by_truth_alone = result.value == truth.value;
    const std::string phase = "phase '" + criterion.phase + "'";
    if (std::isnan(result.value)) return cannot_be_measured(criterion, result);
    if ((!by_truth_alone || result.samples == 0) && !anything_tracked(criterion.phase)) {
      return add(criterion, Severity::error, "nothing is tracked in " + phase,
                 "an 'acquire' before it, or another phase");
    }
    if (result.samples < criterion.samples) {
      return add(
          criterion, Severity::warning,
          "about " + std::to_string(result.samples) + " samples are to be expected in " + phase,
          std::to_string(criterion.samples) + ", or a longer phase");
    }
    if (result.result == criterion_result_t::INCONCLUSIVE) {
      return add(criterion, Severity::warning,
                 "truth itself is uncertain by " + in_unit(2 * result.uncertainty, result.unit) +
                     " (2 sigma): without any error this would be inconclusive",
                 limits_of(result));
    }
    // Nor is where it ends after a fault that was injected.
    const bool certain = !anything_injected() && foreseen(criterion.phase) &&
                         (criterion.measurement->series || timed(criterion.phase));
    if (result.result == criterion_result_t::FAILED && by_truth_alone && certain &&
        !rehearsal_.lost_its_way()) {
      add(criterion, Severity::error,
          "if all goes as planned, " + result.measurement + " in " + phase + " is " +
              in_unit(result.value, result.unit) +
              (criterion.nominal != 0 ? " off its nominal value" : ""),
          limits_of(result));
    }
  }

  void cannot_be_measured(const evaluation::Criterion& criterion,
                          const criterion_result_t& result) {
    const std::string& name = criterion.measurement->name;
    if (name.rfind("docking", 0) == 0 && rig_.cell.target.ports.empty()) {
      return add(criterion, Severity::error,
                 "target '" + rig_.cell.target.name + "' has no docking port",
                 "another target or measurement");
    }
    if (!anything_tracked(criterion.phase)) {
      return add(
          criterion, Severity::error,
          name + " cannot be measured: nothing is tracked in phase '" + criterion.phase + "'",
          "an 'acquire' before it, or another phase");
    }
    add(criterion, Severity::error, name + " cannot be measured: " + result.reason);
  }

  const Procedure& procedure_;
  const Rig& rig_;
  const Rehearsal& rehearsal_;
  evaluation::RunRecord record_;
  evaluation::RunRecord truth_alone_;
  evaluation::Measurer measurer_;
  evaluation::Measurer truth_measurer_;
  std::vector<Finding> findings_;
};

}  // namespace

std::vector<Finding> check_criteria(const Procedure& procedure, const Rig& rig,
                                    const Rehearsal& rehearsal) {
  return CriteriaCheck(procedure, rig, rehearsal).run();
}

}  // namespace berth::procedures
