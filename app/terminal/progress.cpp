// SPDX-License-Identifier: BSD-3-Clause
#include "app/terminal/progress.h"

#include <cstdarg>
#include <cstdio>

#include "logs/compare/comparison.h"

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

const char* word_of(std::int8_t step_state) {
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

const char* word_of_status(std::int8_t status) {
  constexpr const char* words[] = {"idle", "acquiring", "ok", "AMBIGUOUS", "LOST"};
  return status >= 0 && status <= pose_estimate_t::LOST ? words[status] : "?";
}

bool running(const procedure_step_t& step) { return step.state == procedure_step_t::RUNNING; }

constexpr Utime memory = 10 * second;

}  // namespace

void Progress::on(const procedure_state_t& message) {
  print_changes(message);
  state_ = message;
}

void Progress::print_changes(const procedure_state_t& message) {
  const double time = seconds(message.utime - message.utime_start);
  if (message.state == procedure_state_t::PREPARING && message.reason != waiting_for_) {
    waiting_for_ = message.reason;
    if (!waiting_for_.empty()) print_(format("%7.1f s  ", time) + waiting_for_);
  }
  for (std::size_t i = 0; i < message.steps.size(); ++i) {
    const procedure_step_t& step = message.steps[i];
    const bool known = state_ && i < state_->steps.size();
    const std::int8_t before = known ? state_->steps[i].state : procedure_step_t::PENDING;
    if (step.state == before || running(step) || step.state == procedure_step_t::PENDING) continue;
    std::string line = format("%7.1f s  %-8s ", seconds(step.utime_end - message.utime_start),
                              word_of(step.state));
    line += step.name + format("  (%.1f s)", seconds(step.utime_end - step.utime_start));
    if (!step.detail.empty()) line += "  " + step.detail;
    print_(line);
  }
  const bool held = message.state == procedure_state_t::HELD;
  const bool was_held = state_ && state_->state == procedure_state_t::HELD;
  if (held != was_held) print_(format("%7.1f s  %s", time, held ? "HELD" : "goes on"));
}

void Progress::on(const pose_estimate_t& message) {
  estimate_ = message;
  if (message.status != pose_estimate_t::OK) return;
  good_.push_back(message.utime);
  while (message.utime - good_.front() > memory) good_.pop_front();
  uncompared_.push_back(message);
  if (uncompared_.size() > 100) uncompared_.pop_front();
}

void Progress::on(const ground_truth_t& message) {
  truth_.add(logs::sample_of(message));
  const auto& samples = truth_.samples();
  if (samples.back().utime - samples.front().utime > 2 * memory) {
    truth_.forget_before(samples.back().utime - memory);
  }
  compare(samples.back().utime);
}

void Progress::compare(Utime until) {
  while (!uncompared_.empty() && uncompared_.front().utime <= until) {
    const pose_estimate_t& e = uncompared_.front();
    if (const auto truth = truth_.at(e.utime)) {
      const Pose pose{Vector3d::Map(e.position_m),
                      Quaterniond(e.q_wxyz[0], e.q_wxyz[1], e.q_wxyz[2], e.q_wxyz[3])};
      error_ = difference(truth->pose, pose);
    }
    uncompared_.pop_front();
  }
}

void Progress::on(const event_t& message) {
  if (message.severity < event_t::WARNING) return;
  const double time = state_ ? seconds(message.utime - state_->utime_start) : 0;
  print_(
      format("%7.1f s  %-8s ", time, message.severity == event_t::WARNING ? "warning" : "ERROR") +
      message.node + ": " + message.text);
}

std::string Progress::status() const {
  if (!state_) return "waiting for the procedure";
  std::string line = format("%7.1f s  ", seconds(state_->utime - state_->utime_start));
  std::string doing = state_->state == procedure_state_t::PREPARING  ? "preparing"
                      : state_->state == procedure_state_t::FINISHED ? "finished"
                                                                     : "settling";
  if (state_->current_step >= 0 && state_->current_step < state_->step_count) {
    const auto& step = state_->steps[static_cast<std::size_t>(state_->current_step)];
    if (running(step)) doing = step.name + (step.detail.empty() ? "" : " " + step.detail);
  }
  line += (state_->state == procedure_state_t::HELD ? "HELD " : "") + doing;
  if (estimate_) {
    const Vector3d position = Vector3d::Map(estimate_->position_m);
    line += format(" | %s", word_of_status(estimate_->status));
    if (estimate_->status == pose_estimate_t::OK) line += format(", range %.3f m", position.norm());
  }
  if (good_.size() >= 2) {
    line += format(", %.1f Hz",
                   static_cast<double>(good_.size() - 1) / seconds(good_.back() - good_.front()));
  }
  if (error_) {
    line += format(" | error %.1f mm %.2f deg", 1e3 * error_->head<3>().norm(),
                   degrees(error_->tail<3>().norm()));
  }
  if (testbed_ && testbed_->clearance_m >= 0) {
    line += format(" | clearance %.2f m", testbed_->clearance_m);
  }
  return line;
}

bool Progress::finished() const { return state_ && state_->state == procedure_state_t::FINISHED; }

std::string Progress::verdict() const {
  if (!finished()) return {};
  std::string text = state_->criteria.empty() ? "" : logs::verdict_table(state_->criteria) + "\n";
  text += std::string(logs::text_of_outcome(state_->outcome));
  if (!state_->reason.empty()) text += ": " + state_->reason;
  return text + "\n";
}

}  // namespace berth::terminal
