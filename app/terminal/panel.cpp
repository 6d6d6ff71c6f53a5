// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/panel.h"

#include <algorithm>
#include <cmath>

#include "common/bus/loop.h"
#include "common/core/text.h"
#include "evaluation/measure/criterion.h"

namespace berth::terminal {
namespace {

/// Steps shown after the present one, and limits and preconditions at a time.
constexpr std::size_t steps_ahead = 2;
constexpr std::size_t max_limits = 5;
constexpr std::size_t max_unmet = 6;
constexpr std::size_t indent = 2;
constexpr std::size_t reason_width = 76;  // of a terminal with 80 columns

Style style_of_state(std::int8_t state) {
  switch (state) {
    case procedure_state_t::RUNNING:
      return Style::good;
    case procedure_state_t::HELD:
    case procedure_state_t::PROMPTING:
      return Style::warning;
    default:
      return Style::strong;
  }
}

Line heading(const procedure_state_t& state) {
  Line line(state.procedure, Style::strong);
  line.add("  ").add(text_of_state(state.state), style_of_state(state.state));
  line.add("  " + text_of_duration(seconds(state.utime - state.utime_start)));
  if (state.current_step >= 0) {
    line.add("  step " + std::to_string(state.current_step + 1) + " of " +
                 std::to_string(state.step_count),
             Style::faint);
  }
  return line;
}

/// The step under way, or the one before a hold, and those that come next.
void add_steps(const procedure_state_t& state, std::vector<Line>& lines) {
  const auto present = static_cast<std::size_t>(std::max(0, state.current_step));
  const std::size_t end = std::min(state.steps.size(), present + 1 + steps_ahead);
  for (std::size_t i = present; i < end; ++i) {
    const procedure_step_t& step = state.steps[i];
    const bool runs = step.state == procedure_step_t::RUNNING;
    Line line(std::string(indent, ' '));
    line.add(runs ? "> " : "  ", Style::good);
    line.add(std::string(2 * static_cast<std::size_t>(std::max<int>(0, step.depth)), ' '));
    line.add(step.name, runs ? Style::strong : Style::faint);
    if (step.attempts > 1) {
      line.add("  attempt " + std::to_string(step.attempts), Style::warning);
    }
    if (runs) {
      line.tab(34).add(text_of_duration(seconds(state.utime - step.utime_start)));
      line.tab(46).add(step.detail);
    } else if (step.utime_end != 0) {
      line.tab(34).add(text_of_step(step.state), style_of_step(step.state));
    }
    lines.push_back(line);
  }
}

/// How much of the way to its limit is left decides which limits are shown.
double relative_margin(const criterion_result_t& limit) {
  const double size = std::isfinite(limit.lower_limit) && std::isfinite(limit.upper_limit)
                          ? limit.upper_limit - limit.lower_limit
                      : std::isfinite(limit.lower_limit) ? std::abs(limit.lower_limit)
                                                         : std::abs(limit.upper_limit);
  const double margin = evaluation::margin(limit);
  return std::isnan(margin) ? HUGE_VAL : margin / std::max(size, 1e-9);
}

void add_limits(const procedure_state_t& state, std::vector<Line>& lines) {
  std::vector<criterion_result_t> limits = state.limits;
  std::stable_sort(limits.begin(), limits.end(), [](const auto& a, const auto& b) {
    return relative_margin(a) < relative_margin(b);
  });
  if (limits.size() > max_limits) limits.resize(max_limits);
  for (const criterion_result_t& limit : limits) {
    const double margin = evaluation::margin(limit);
    const bool bad = limit.result == criterion_result_t::FAILED;
    const bool near = relative_margin(limit) < 0.1;
    Line line(std::string(indent, ' '));
    line.add("limit ", Style::faint).add(limit.name);
    line.tab(34).add(shown(limit.value) + " " + limit.unit, bad    ? Style::bad
                                                            : near ? Style::warning
                                                                   : Style::good);
    std::string range;
    if (std::isfinite(limit.lower_limit)) range += "at least " + shown(limit.lower_limit);
    if (std::isfinite(limit.upper_limit)) {
      range += (range.empty() ? "" : ", ") + std::string("at most ") + shown(limit.upper_limit);
    }
    line.tab(50).add(range, Style::faint);
    if (!std::isnan(margin)) line.tab(76).add("margin " + shown(margin));
    lines.push_back(line);
  }
}

/// What stands in the way of going on.
void add_preconditions(const procedure_state_t& state, std::vector<Line>& lines) {
  if (state.state != procedure_state_t::HELD) return;
  std::size_t count = 0;
  for (const precondition_t& precondition : state.preconditions) {
    if (precondition.met) continue;
    if (++count > max_unmet) break;
    lines.push_back(line_of(precondition));
  }
}

void add_prompt(const procedure_state_t& state, std::vector<Line>& lines) {
  if (state.state != procedure_state_t::PROMPTING) return;
  Line line("  ? ", Style::warning);
  line.add(state.prompt, Style::strong);
  const std::string choices = choices_of(state);
  if (!choices.empty()) line.add(" " + choices);
  lines.push_back(line);
  Line about("    prompt " + state.prompt_id, Style::faint);
  if (state.utime_prompt_expires != 0) {
    about.add(
        ", " + text_of_duration(std::max(0.0, seconds(state.utime_prompt_expires - state.utime))) +
            " left",
        Style::warning);
  }
  lines.push_back(about);
}

}  // namespace

std::vector<Line> panel(const procedure_state_t& state) {
  std::vector<Line> lines{heading(state)};
  const bool preparing = state.state == procedure_state_t::PREPARING;
  if (!state.reason.empty()) {
    for (const std::string& part : wrapped(state.reason, reason_width)) {
      lines.push_back(Line("  " + part, preparing ? Style::plain : Style::warning));
    }
  }
  add_preconditions(state, lines);
  if (!preparing) add_steps(state, lines);
  add_limits(state, lines);
  add_prompt(state, lines);
  return lines;
}

Line line_of(const precondition_t& precondition) {
  Line line;
  line.add(precondition.met ? "  ok   " : "  BAD  ", precondition.met ? Style::good : Style::bad);
  line.add(precondition.name);
  if (!precondition.reason.empty()) {
    line.tab(34).add(precondition.reason, precondition.met ? Style::faint : Style::plain);
  }
  return line;
}

const char* text_of_state(std::int8_t state) {
  constexpr const char* words[] = {"PREPARING",           "RUNNING",  "HELD",
                                   "WAITS FOR AN ANSWER", "TEARDOWN", "FINISHED"};
  return state >= 0 && state <= procedure_state_t::FINISHED ? words[state] : "?";
}

const char* text_of_step(std::int8_t step_state) {
  switch (step_state) {
    case procedure_step_t::PASSED:
      return "done";
    case procedure_step_t::FAILED:
      return "FAILED";
    case procedure_step_t::ERROR:
      return "ERROR";
    case procedure_step_t::TIMEOUT:
      return "TIME-OUT";
    case procedure_step_t::ABORTED:
      return "aborted";
    case procedure_step_t::SKIPPED:
      return "skipped";
    default:
      return "";
  }
}

Style style_of_step(std::int8_t step_state) {
  switch (step_state) {
    case procedure_step_t::PASSED:
      return Style::good;
    case procedure_step_t::ABORTED:
    case procedure_step_t::SKIPPED:
      return Style::warning;
    case procedure_step_t::FAILED:
    case procedure_step_t::ERROR:
    case procedure_step_t::TIMEOUT:
      return Style::bad;
    default:
      return Style::plain;
  }
}

std::string choices_of(const procedure_state_t& state) {
  std::string text;
  for (const std::string& choice : state.choices) text += (text.empty() ? "" : " / ") + choice;
  return text.empty() ? "" : "[" + text + "]";
}

}  // namespace berth::terminal
