// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/operator_keys.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <utility>

#include "app/terminal/panel.h"
#include "common/core/text.h"

namespace berth::terminal {
namespace {

constexpr char control_d = 4;
constexpr char control_u = 21;
constexpr char escape = 27;
constexpr char backspace = 8;
constexpr char rubout = 127;

struct Key {
  char key;
  std::int8_t command;
  const char* name;
  const char* help;
};

constexpr Key keys[] = {
    {'h', procedure_command_t::HOLD, "hold",
     "the arms come to rest on their path; time stands still"},
    {'r', procedure_command_t::RESUME, "resume", "conditions are looked at again, then it goes on"},
    {'n', procedure_command_t::STEP, "step", "goes on, and holds after this step"},
    {'s', procedure_command_t::SKIP, "skip", "leaves this step out; prompts for the reason"},
    {'t', procedure_command_t::RETRY, "retry", "begins the step anew"},
    {'x', procedure_command_t::RESET, "reset", "the controllers' alarms; then resume goes on"},
    {'a', procedure_command_t::ABORT, "abort",
     "at once, then the teardown; again: hurries the teardown"},
};

constexpr char control_key = 'c';
constexpr char faster_key = '+';
constexpr char slower_key = '-';
constexpr double speed_step = 0.1;

bool begins_with(const std::string& text, const std::string& start) {
  return start.size() <= text.size() &&
         std::equal(start.begin(), start.end(), text.begin(), [](char a, char b) {
           return std::tolower(static_cast<unsigned char>(a)) ==
                  std::tolower(static_cast<unsigned char>(b));
         });
}

}  // namespace

void OperatorKeys::on(const procedure_state_t& state) {
  const bool prompted = prompting();
  const std::string id = prompted ? state_->prompt_id : "";
  const bool changed =
      !state_ || state_->state != state.state || state_->current_step != state.current_step;
  if (changed && mode_ == Mode::keys) remark_.clear();  // it was obeyed
  state_ = state;
  if (prompting() && (!prompted || state.prompt_id != id) && !observing_) {
    mode_ = Mode::answer;
    text_.clear();
    remark_.clear();
  } else if (prompted && !prompting() && mode_ == Mode::answer) {
    mode_ = Mode::keys;
  }
}

void OperatorKeys::on_answer(CommandStatus status, const std::string& reason) {
  remark_ = status == CommandStatus::accepted  ? ""
            : status == CommandStatus::refused ? "refused: " + reason
                                               : reason;
}

void OperatorKeys::type(char key) {
  if (key == control_d) {
    leaves_ = true;
  } else if (mode_ == Mode::keys) {
    type_command(key);
  } else {
    type_text(key);
  }
}

void OperatorKeys::type_command(char key) {
  remark_.clear();
  if (key == 'q') {
    leaves_ = true;
  } else if (key == '?') {
    help_ = !help_;
  } else if (observing_) {
    remark_ = "only observing: q leaves";
  } else if (prompting() && (key == '\n' || key == '\r')) {
    mode_ = Mode::answer;
  } else if (key == 's') {
    mode_ = Mode::reason;
    text_.clear();
  } else if (key == control_key) {
    take_or_release_control();
  } else if (key == faster_key || key == slower_key) {
    change_speed(key == faster_key ? speed_step : -speed_step);
  } else {
    for (const Key& known : keys) {
      if (known.key != key) continue;
      send(known.command, key == 'a' ? "aborted by the operator" : "");
      remark_ = std::string(known.name) + " requested";
    }
  }
}

void OperatorKeys::take_or_release_control() {
  const std::string requested_over = std::exchange(requested_over_, "");
  if (has_control()) {
    send(procedure_command_t::RELEASE_CONTROL);
    remark_ = "control given back";
  } else if (holder_.empty()) {
    send(procedure_command_t::TAKE_CONTROL);
    remark_ = "control requested";
  } else if (requested_over == holder_) {
    send(procedure_command_t::TAKE_CONTROL, "take over");
    remark_ = "control of " + holder_ + " requested";
  } else {
    requested_over_ = holder_;
    remark_ = holder_ + " has control: once more takes it over";
  }
}

void OperatorKeys::change_speed(double by) {
  const double speed =
      std::clamp(speed_step * std::round((speed_ + by) / speed_step), speed_step, 1.0);
  const std::string percent = fixed(100 * speed, 0) + " %";
  send(procedure_command_t::SPEED, percent);
  speed_ = speed;
  remark_ = "speed " + percent + " requested";
}

void OperatorKeys::type_text(char key) {
  if (key == '\n' || key == '\r') {
    finish_text();
  } else if (key == escape) {
    mode_ = Mode::keys;
    text_.clear();
  } else if (key == backspace || key == rubout) {
    while (!text_.empty() && (static_cast<unsigned char>(text_.back()) & 0xC0U) == 0x80U) {
      text_.pop_back();
    }
    if (!text_.empty()) text_.pop_back();
  } else if (key == control_u) {
    text_.clear();
  } else if (static_cast<unsigned char>(key) >= ' ') {
    text_ += key;
  }
}

void OperatorKeys::finish_text() {
  if (mode_ == Mode::reason) {
    if (text_.empty()) {
      remark_ = "a skipped step needs a reason";
      return;
    }
    send(procedure_command_t::SKIP, text_);
    remark_ = "skip requested";
  } else {
    const auto answer = chosen();
    if (!answer) {
      remark_ = "expected one of " + choices_of(*state_);
      return;
    }
    send(procedure_command_t::ANSWER, *answer);
    remark_ = "answered " + *answer;
  }
  mode_ = Mode::keys;
  text_.clear();
}

std::optional<std::string> OperatorKeys::chosen() const {
  if (!state_ || state_->choices.empty()) return text_;
  std::optional<std::string> found;
  for (const std::string& choice : state_->choices) {
    if (choice == text_) return choice;
    if (text_.empty() || !begins_with(choice, text_)) continue;
    if (found) return std::nullopt;
    found = choice;
  }
  return found;
}

void OperatorKeys::send(std::int8_t command, const std::string& text) {
  procedure_command_t request{};
  request.command = command;
  request.text = text;
  if (command == procedure_command_t::ANSWER) request.prompt_id = state_->prompt_id;
  send_(request);
}

std::vector<Line> OperatorKeys::lines() const {
  std::vector<Line> lines;
  if (help_) {
    if (!observing_) {
      for (const Key& key : keys) {
        lines.push_back(Line("  ").add(std::string(1, key.key), Style::strong));
        lines.back().tab(6).add(key.name).tab(15).add(key.help, Style::faint);
      }
      lines.push_back(Line("  + -", Style::strong));
      lines.back().tab(6).add("speed").tab(15).add("of all motion, by 10 %; the path stays",
                                                   Style::faint);
      lines.push_back(Line("  c", Style::strong));
      lines.back().tab(6).add("control").tab(15).add(
          "taken, so that only this terminal steers; again: given back", Style::faint);
      lines.push_back(Line("  Ctrl-C", Style::strong));
      lines.back().tab(15).add("aborts, too; again: ends every process at once", Style::faint);
    }
    lines.push_back(Line("  q", Style::strong));
    lines.back().tab(6).add("leave").tab(15).add(
        "or Ctrl-D; the run goes on, berth attach shows it again", Style::faint);
  }
  if (!remark_.empty()) lines.push_back(Line("  " + remark_, Style::warning));
  if (mode_ == Mode::reason) {
    lines.push_back(Line("  why is it skipped? ", Style::strong).add(text_ + "_"));
    lines.push_back(Line("  Enter sends, Escape does not", Style::faint));
  } else if (mode_ == Mode::answer) {
    lines.push_back(Line("  answer: ", Style::strong).add(text_ + "_"));
    lines.push_back(Line("  Enter sends, Escape gives the keys back, Ctrl-C aborts", Style::faint));
  } else {
    Line line(" ");
    if (!observing_) {
      for (const Key& key : keys) {
        line.add(" ").add(std::string(1, key.key), Style::strong);
        line.add(" " + std::string(key.name) + " ", Style::faint);
      }
      line.add(" ").add("+ -", Style::strong).add(" speed ", Style::faint);
      line.add(" ").add("c", Style::strong).add(" control ", Style::faint);
      if (prompting()) line.add(" ").add("Enter", Style::strong).add(" answer ", Style::faint);
    }
    line.add(" ").add("q", Style::strong).add(" leave ", Style::faint);
    line.add(" ").add("?", Style::strong).add(" help", Style::faint);
    lines.push_back(line);
  }
  return lines;
}

}  // namespace berth::terminal
