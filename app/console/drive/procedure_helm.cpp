// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/drive/procedure_helm.h"

#include <algorithm>
#include <utility>

namespace berth::console {
namespace {

constexpr Utime silence = 2 * second;                ///< after which no engine is there
constexpr Utime time_to_refuse = 300 * millisecond;  ///< after it has heard
constexpr Utime time_to_hear = 2 * second;

}  // namespace

ProcedureHelm::ProcedureHelm(Bus& bus, Loop& loop, std::int64_t session)
    : bus_(bus), loop_(loop), session_(session) {}

bool ProcedureHelm::active() const {
  return state_ && state_->state != procedure_state_t::FINISHED &&
         loop_.now() - state_heard_ <= silence;
}

void ProcedureHelm::on(const procedure_state_t& state) {
  if (state.session != session_) return;
  state_ = state;
  state_heard_ = loop_.now();
  for (auto& [who, link] : links_) link.on(state);
}

void ProcedureHelm::on(const operator_control_t& control) {
  if (control.session == session_) control_ = control;
}

OperatorLink& ProcedureHelm::link(const std::string& who) {
  return links_.try_emplace(who, bus_, loop_, session_, who).first->second;
}

void ProcedureHelm::ask(const std::string& who, procedure_command_t command, Done done) {
  asked_.push_back({who, std::move(done), loop_.now(), 0, ++count_});
  link(who).send(std::move(command));
}

void ProcedureHelm::keep_control(const std::string& who) { link(who).keep_control(); }

void ProcedureHelm::on(const event_t& event) {
  if (event.session != session_ || event.node != "procedure") return;
  for (auto& [who, link] : links_) link.on(event);
  if (event.code == "operator-command") {
    const auto ours = std::find_if(asked_.begin(), asked_.end(), [&](const Asked& asked) {
      return asked.heard == 0 && event.text.rfind(asked.who + ": ", 0) == 0;
    });
    heard_last_ = ours == asked_.end() ? 0 : ours->number;
    if (ours != asked_.end()) ours->heard = loop_.now();
  } else if (event.code == "command-refused" && heard_last_ != 0) {
    end(std::exchange(heard_last_, 0), false, event.text);
  }
}

void ProcedureHelm::tick() {
  const Utime now = loop_.now();
  if (!active()) control_ = {};
  const std::deque<Asked> asked = asked_;  // what is called may ask again
  for (const Asked& one : asked) {
    if (one.heard != 0 && now - one.heard >= time_to_refuse) end(one.number, true, "");
    if (one.heard == 0 && now - one.sent >= time_to_hear) {
      link(one.who).give_up();
      end(one.number, false, no_answer);
    }
  }
}

void ProcedureHelm::end(int number, bool accepted, const std::string& text) {
  const auto found = std::find_if(asked_.begin(), asked_.end(),
                                  [number](const Asked& asked) { return asked.number == number; });
  if (found == asked_.end()) return;
  const Done done = std::move(found->done);
  asked_.erase(found);
  if (done) done(accepted, text);
}

}  // namespace berth::console
