// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/check_list.h"

#include <algorithm>
#include <cstdio>

#include "common/core/pose.h"
#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::terminal {
namespace {

using procedures::CheckReport;
using procedures::Finding;
using procedures::Severity;
using procedures::StepForecast;

// Columns of the list.
constexpr std::size_t at_line = 6;
constexpr std::size_t at_step = 12;
constexpr std::size_t at_time = 36;
constexpr std::size_t at_clearance = 48;
constexpr std::size_t at_margin = 82;

Style style_of(Severity severity) {
  return severity == Severity::error     ? Style::bad
         : severity == Severity::warning ? Style::warning
                                         : Style::faint;
}

std::string right(const std::string& text, std::size_t width) {
  return std::string(width - std::min(width, columns(text)), ' ') + text;
}

std::string cut(const std::string& text, std::size_t width) {
  return Line(text).rendered(false, width);
}

void add_finding(std::vector<Line>& lines, const Finding& finding, std::size_t indent,
                 const std::string& text, std::size_t width) {
  const std::string label = std::string(name_of(finding.severity)) + ": ";
  bool first = true;
  for (const std::string& part : wrapped(text, width - indent - label.size())) {
    Line line(std::string(indent, ' '));
    line.add(first ? label : std::string(label.size(), ' '), style_of(finding.severity));
    line.add(part, finding.severity == Severity::note ? Style::faint : Style::plain);
    lines.push_back(line);
    first = false;
  }
}

std::string what(const Finding& finding) {
  return finding.found + (finding.expected.empty() ? "" : "; expected " + finding.expected);
}

/// "replica arm's pedestal" is too long for a list.
std::string brief(std::string body) {
  const auto at = body.find(" arm's");
  return at == std::string::npos ? body : body.erase(at, 6);
}

Line heading() {
  Line line(std::string(at_line, ' '));
  line.add("line", Style::faint).tab(at_step).add("step", Style::faint);
  line.tab(at_time + 5).add("takes", Style::faint);
  line.tab(at_clearance).add("clearance", Style::faint);
  line.tab(at_margin).add("joint margin", Style::faint);
  return line;
}

Line row(const StepForecast& step, bool teardown, Severity worst) {
  Line line;
  line.add(worst == Severity::error     ? "  BAD "
           : worst == Severity::warning ? "  look"
                                        : "  ok  ",
           worst == Severity::note ? Style::good : style_of(worst));
  line.add(step.line > 0 ? right(std::to_string(step.line), 4) : "    ", Style::faint).tab(at_step);
  line.add(cut((teardown ? "teardown: " : "") + step.name, at_time - at_step - 1));
  line.tab(at_time);
  line.add(right((step.guessed ? "~" : "") + text_of_duration(step.duration), 10));
  if (!step.moves) return line;
  if (!step.near_a.empty()) {
    line.tab(at_clearance).add(fixed(step.clearance, 2) + " m ");
    line.add(cut(brief(step.near_a) + " - " + brief(step.near_b), at_margin - line.width() - 1),
             Style::faint);
  }
  if (!step.joint.empty()) {
    line.tab(at_margin).add(right(fixed(degrees(step.joint_margin), 0), 3) + " deg ");
    line.add(step.joint, Style::faint);
  }
  return line;
}

Line summary(const CheckReport& report) {
  const auto count = [&report](Severity severity) {
    return std::count_if(report.findings.begin(), report.findings.end(),
                         [severity](const Finding& f) { return f.severity == severity; });
  };
  const auto errors = count(Severity::error);
  const auto warnings = count(Severity::warning);
  Line line(" ");
  if (errors > 0) {
    line.add(" BAD ", Style::bad);
    line.add(std::to_string(errors) + (errors == 1 ? " error" : " errors"));
  } else {
    line.add(" ok  ", Style::good).add("ready");
  }
  if (warnings > 0) {
    line.add(", " + std::to_string(warnings) + (warnings == 1 ? " warning" : " warnings"));
  }
  if (report.name.empty()) return line;
  line.add(": " + std::to_string(report.main_steps) + " steps, " + std::to_string(report.criteria) +
           " criteria, expected to take " + (report.guessed ? "about " : "") +
           text_of_duration(report.duration));
  return line;
}

}  // namespace

std::vector<Line> check_list(const CheckReport& report, std::size_t width) {
  std::vector<Line> lines;
  Line title(report.file, Style::strong);
  if (!report.layout.empty()) {
    title.add("  layout " + report.layout + ", target " + report.target, Style::faint);
  }
  lines.push_back(title);
  if (!report.steps.empty()) lines.push_back(heading());
  for (std::size_t i = 0; i < report.steps.size(); ++i) {
    const auto mine = [i](const Finding& f) { return f.step == static_cast<int>(i); };
    Severity worst = Severity::note;
    for (const Finding& f : report.findings) {
      if (mine(f)) worst = std::min(worst, f.severity);
    }
    lines.push_back(row(report.steps[i], i >= report.main_steps, worst));
    for (const Finding& f : report.findings) {
      if (mine(f)) add_finding(lines, f, at_step, what(f), width);
    }
  }
  for (const Finding& f : report.findings) {
    if (f.step >= 0) continue;
    const std::string place = f.line > 0 ? f.file + ":" + std::to_string(f.line) + ": " : "";
    add_finding(lines, f, at_line, place + (f.key.empty() ? "" : f.key + ": ") + what(f), width);
  }
  lines.push_back(summary(report));
  return lines;
}

}  // namespace berth::terminal
