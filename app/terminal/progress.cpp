// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/progress.h"

#include <cstdarg>
#include <cstdio>

#include "app/terminal/panel.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/words.h"

namespace berth::terminal {
namespace {

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...) {
  char text[400];
  va_list arguments;
  va_start(arguments, pattern);
  std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return text;
}

const char* word_of_status(std::int8_t status) {
  constexpr const char* words[] = {"idle", "acquiring", "ok", "AMBIGUOUS", "LOST"};
  return status >= 0 && status <= pose_estimate_t::LOST ? words[status] : "?";
}

constexpr Utime memory = 10 * second;
constexpr Utime repeat_waiting = 10 * second;

/// "  123.4 s  ": with which every lasting line begins.
Line stamped(double time) { return Line(format("%7.1f s  ", time), Style::faint); }

/// Words of equal width after the time.
Line& add_word(Line& line, const std::string& word, Style style) {
  return line.add(word, style).tab(20);
}

}  // namespace

void Progress::on(const procedure_state_t& message) {
  print_changes(message);
  latest_.on(message);
}

void Progress::print_changes(const procedure_state_t& message) {
  const std::int8_t before =
      latest_.procedure ? latest_.procedure->state : procedure_state_t::PREPARING;
  print_preparation(message);
  print_steps(message);
  print_prompt(message);
  const bool held = message.state == procedure_state_t::HELD;
  if (held == (before == procedure_state_t::HELD)) return;
  const double time = seconds(message.utime - message.utime_start);
  print_(stamped(time).add(held ? "HELD" : "goes on", Style::warning));
}

void Progress::print_preparation(const procedure_state_t& message) {
  const bool begins = message.state != procedure_state_t::PREPARING;
  if (begins && (!latest_.procedure || latest_.procedure->state != procedure_state_t::PREPARING))
    return;
  const Line stamp = stamped(seconds(message.utime - message.utime_start));
  if (!begins) {
    // The list of missing preconditions shrinks all the time: printed once, and again after a
    // while.
    const bool again = message.utime - waited_since_ >= repeat_waiting;
    if (with_panel_ || message.reason.empty() || message.reason == waiting_for_ ||
        !(waiting_for_.empty() || again)) {
      return;
    }
    waiting_for_ = message.reason;
    waited_since_ = message.utime;
    return print_(Line(stamp).add(message.reason));
  }
  if (message.state == procedure_state_t::TEARDOWN ||
      message.state == procedure_state_t::FINISHED) {
    for (const precondition_t& p : message.preconditions) {
      if (!p.met) print_(line_of(p));
    }
    return;
  }
  std::size_t nodes = 0;
  std::string others;
  for (const precondition_t& p : message.preconditions) {
    const bool is_node = p.name.rfind("node ", 0) == 0;
    nodes += is_node ? 1 : 0;
    if (!is_node) others += ", " + p.name;
  }
  if (message.preconditions.empty()) return;
  Line line = stamp;
  print_(add_word(line, "ready", Style::good).add(std::to_string(nodes) + " nodes" + others));
}

void Progress::print_steps(const procedure_state_t& message) {
  for (std::size_t i = 0; i < message.steps.size(); ++i) {
    const procedure_step_t& step = message.steps[i];
    const bool known = latest_.procedure && i < latest_.procedure->steps.size();
    const std::int8_t before =
        known ? latest_.procedure->steps[i].state : procedure_step_t::PENDING;
    const std::string word = text_of_step(step.state);
    if (step.state == before || word.empty()) continue;
    const bool began = step.utime_start != 0;  // steps that are skipped may never have
    Line line = stamped(seconds((began ? step.utime_end : message.utime) - message.utime_start));
    add_word(line, word, style_of_step(step.state)).add(step.name, Style::strong);
    if (began) {
      line.add("  (" + text_of_duration(seconds(step.utime_end - step.utime_start)) + ")",
               Style::faint);
    }
    if (!step.detail.empty()) line.add("  " + step.detail);
    print_(line);
  }
}

void Progress::print_prompt(const procedure_state_t& message) {
  if (message.state != procedure_state_t::PROMPTING) return;
  const bool shown_before = latest_.procedure &&
                            latest_.procedure->state == procedure_state_t::PROMPTING &&
                            latest_.procedure->prompt_id == message.prompt_id &&
                            latest_.procedure->utime_prompt_expires == message.utime_prompt_expires;
  if (shown_before) return;
  Line line = stamped(seconds(message.utime - message.utime_start));
  add_word(line, "prompt", Style::warning).add(message.prompt, Style::strong);
  const std::string choices = choices_of(message);
  if (!choices.empty()) line.add(" " + choices);
  print_(line.add("  (prompt " + message.prompt_id + ")", Style::faint));
}

void Progress::on(const pose_estimate_t& message) {
  latest_.on(message);
  if (message.status != pose_estimate_t::OK) return;
  good_.push_back(message.utime);
  while (message.utime - good_.front() > memory) good_.pop_front();
  error_.on(message);
}

void Progress::on(const event_t& message) {
  // the prompt is shown with the state
  const bool answer = message.node == "procedure" && message.severity == event_t::NOTICE &&
                      message.code != "prompt";
  if (message.severity < event_t::WARNING && !answer) return;
  Line line =
      stamped(latest_.procedure ? seconds(message.utime - latest_.procedure->utime_start) : 0);
  const bool serious = message.severity > event_t::WARNING;
  add_word(line,
           serious  ? "ERROR"
           : answer ? "notice"
                    : "warning",
           serious  ? Style::bad
           : answer ? Style::plain
                    : Style::warning);
  print_(line.add((answer ? "" : message.node + ": ") + message.text));
}

std::vector<Line> Progress::panel() const {
  if (!latest_.procedure) return {Line("waiting for the procedure", Style::faint)};
  std::vector<Line> lines = terminal::panel(*latest_.procedure);
  if (!holder_.empty()) lines.push_back(Line("  " + holder_ + " has control", Style::warning));
  const std::string estimate = status();
  if (!estimate.empty()) lines.push_back(Line("  ").add(estimate));
  return lines;
}

std::string Progress::status() const {
  std::string line;
  if (latest_.estimate) {
    const Vector3d position = Vector3d::Map(latest_.estimate->position_m);
    line += format("estimate %s", word_of_status(latest_.estimate->status));
    if (latest_.estimate->status == pose_estimate_t::OK)
      line += format(", range %.3f m", position.norm());
    if (good_.size() >= 2) {
      line += format(", %.1f Hz",
                     static_cast<double>(good_.size() - 1) / seconds(good_.back() - good_.front()));
    }
    if (const auto& compared = error_.latest()) {
      line += format(" | error %.1f mm %.2f deg", 1e3 * compared->error.head<3>().norm(),
                     degrees(compared->error.tail<3>().norm()));
    }
  }
  if (latest_.testbed && latest_.testbed->clearance_m >= 0) {
    line += (line.empty() ? "" : " | ") + format("clearance %.2f m", latest_.testbed->clearance_m);
  }
  if (latest_.testbed && latest_.testbed->speed_override > 0 &&
      latest_.testbed->speed_override < 1) {
    line += (line.empty() ? "" : " | ") +
            format("speed %.0f %%", 100 * latest_.testbed->speed_override);
  }
  return line;
}

bool Progress::finished() const {
  return latest_.procedure && latest_.procedure->state == procedure_state_t::FINISHED;
}

std::string Progress::verdict() const {
  if (!finished()) return {};
  std::string text =
      latest_.procedure->criteria.empty()
          ? ""
          : text_table(evaluation::criteria_table(latest_.procedure->criteria)) + "\n";
  text += std::string(words::of_outcome(latest_.procedure->outcome));
  if (!latest_.procedure->reason.empty()) text += ": " + latest_.procedure->reason;
  return text + "\n";
}

}  // namespace berth::terminal
