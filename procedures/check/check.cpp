// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/check/check.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/core/text.h"
#include "drivers/lidar/limits.h"

namespace berth::procedures {

const char* name_of(Severity severity) {
  switch (severity) {
    case Severity::error:
      return "error";
    case Severity::warning:
      return "warning";
    default:
      return "note";
  }
}

std::string text_of(const Finding& finding) {
  std::string text = finding.file;
  if (finding.line > 0) text += ":" + std::to_string(finding.line);
  text += std::string(": ") + name_of(finding.severity) + ": ";
  if (!finding.key.empty()) text += finding.key + ": ";
  text += finding.found;
  if (!finding.expected.empty()) text += "; expected " + finding.expected;
  return text;
}

Finding finding_of_error(const std::string& what, const std::string& file) {
  Finding finding;
  finding.file = file;
  finding.found = what;
  // the error may name another file: that of a called procedure
  const auto digits = what.find_first_of("0123456789", what.find(':'));
  const auto colon = what.find(": ");
  if (colon == std::string::npos || digits == std::string::npos || digits > colon) return finding;
  const auto before = what.rfind(':', colon - 1);
  if (before == std::string::npos) return finding;
  const std::string number = what.substr(before + 1, colon - before - 1);
  if (number.empty() || number.size() > 9 ||
      number.find_first_not_of("0123456789") != std::string::npos) {
    return finding;
  }
  finding.file = what.substr(0, before);
  finding.line = std::stoi(number);
  finding.found = what.substr(colon + 2);
  return finding;
}

bool has_errors(const std::vector<Finding>& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& f) { return f.severity == Severity::error; });
}

namespace {

class StepCheck {
 public:
  StepCheck(const Rig& rig, std::vector<Finding>& findings) : rig_(rig), findings_(findings) {}

  void look_at(const Step& step, const StepForecast& forecast) {
    step_ = &step;
    ++index_;
    if (const auto* track = std::get_if<Track>(&step.verb)) look_at(*track);
    if (const auto* scan = std::get_if<Scan>(&step.verb)) look_at(*scan);
    if (!forecast.refusal.empty()) {
      add(forecast.from_afar ? Severity::warning : Severity::error,
          "the testbed refuses: " + forecast.refusal +
              (forecast.from_afar ? " (from where the motion refused before begins)" : ""));
    }
    if (forecast.duration > step.timeout) {
      add(forecast.guessed ? Severity::warning : Severity::error,
          "takes " + fixed(forecast.duration, 1) + " s",
          "no more than its timeout of " + fixed(step.timeout, 1) + " s");
    }
  }

 private:
  void add(Severity severity, const std::string& found, const std::string& expected = "") {
    findings_.push_back({severity, step_->file, step_->line, "step '" + step_->name + "'", found,
                         expected, index_});
  }

  void look_at(const Track& track) {
    estimator::ScanStrategy strategy{};
    if (track.strategy.empty() || estimator::parse_scan_strategy(track.strategy, strategy)) return;
    add(Severity::error, "found strategy '" + track.strategy + "'",
        "one of: " + joined(estimator::scan_strategy_names()));
  }

  void look_at(const Scan& scan) {
    const std::string wrong = lidar::check_windows(rig_.lidar, {scan.window});
    if (!wrong.empty())
      add(Severity::error, "the LIDAR " + rig_.lidar.model + " refuses: " + wrong);
  }

  const Rig& rig_;
  std::vector<Finding>& findings_;
  const Step* step_ = nullptr;
  int index_ = -1;
};

void append(std::vector<Finding>& findings, std::vector<Finding> more) {
  findings.insert(findings.end(), std::make_move_iterator(more.begin()),
                  std::make_move_iterator(more.end()));
}

}  // namespace

CheckReport check_procedure(const Procedure& procedure, const RunSetup& setup,
                            const std::optional<testbed::ArmPair>& start) {
  CheckReport report;
  report.file = procedure.file;
  report.name = procedure.name;
  report.layout = setup.layout;
  report.target = std::filesystem::path(setup.target).filename().string();
  report.criteria = procedure.criteria.size();
  report.main_steps = procedure.steps.size();

  Rig rig(setup);
  for (const std::string& note : target_notes(rig.cell.target)) {
    report.findings.push_back({Severity::warning, setup.target, 0, "target", note, ""});
  }
  Rehearsal rehearsal(rig, start.value_or(rig.home()));
  StepCheck steps(rig, report.findings);
  for (const Step& step : procedure.steps) steps.look_at(step, rehearsal.perform(step));
  append(report.findings, check_visibility(procedure, rig, rehearsal));
  for (const Step& step : procedure.teardown) steps.look_at(step, rehearsal.perform(step));
  append(report.findings, check_criteria(procedure, rig, rehearsal));

  std::stable_sort(report.findings.begin(), report.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.line < b.line; });
  report.steps = rehearsal.steps();
  report.duration = rehearsal.duration();
  for (const StepForecast& step : report.steps) report.guessed = report.guessed || step.guessed;
  return report;
}

CheckReport report_of_error(const std::string& what, const std::string& file) {
  CheckReport report;
  report.file = file;
  report.findings.push_back(finding_of_error(what, file));
  return report;
}

nlohmann::json json_of(const CheckReport& report) {
  using nlohmann::json;
  json findings = json::array();
  for (const Finding& f : report.findings) {
    findings.push_back({{"severity", name_of(f.severity)},
                        {"file", f.file},
                        {"line", f.line},
                        {"key", f.key},
                        {"found", f.found},
                        {"expected", f.expected},
                        {"step", f.step}});
  }
  json steps = json::array();
  for (std::size_t i = 0; i < report.steps.size(); ++i) {
    const StepForecast& s = report.steps[i];
    json step = {{"name", s.name},       {"phase", s.phase},
                 {"line", s.line},       {"teardown", i >= report.main_steps},
                 {"start_s", s.start},   {"duration_s", s.duration},
                 {"guessed", s.guessed}, {"refusal", s.refusal},
                 {"remark", s.remark}};
    if (s.moves && !s.near_a.empty()) {
      step["clearance_m"] = s.clearance;
      step["clearance_between"] = {s.near_a, s.near_b};
    }
    if (s.moves && !s.joint.empty()) {
      step["joint_margin_rad"] = s.joint_margin;
      step["joint"] = s.joint;
    }
    steps.push_back(step);
  }
  return {{"file", report.file},       {"procedure", report.name},
          {"layout", report.layout},   {"target", report.target},
          {"good", report.good()},     {"duration_s", report.duration},
          {"guessed", report.guessed}, {"criteria", report.criteria},
          {"findings", findings},      {"steps", steps}};
}

}  // namespace berth::procedures
