// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor/arm_examination.h"

#include <algorithm>
#include <cmath>

#include "app/doctor/finding.h"
#include "common/core/text.h"
#include "drivers/arm/report_evaluation.h"

namespace berth {
namespace {

constexpr const char* does_logic_run =
    "does the background logic that counts it run? (docs/commissioning.md)";

using State = Finding::State;

constexpr int command_block_every = 5;  // status reads

std::string in_ms(Utime t) { return fixed(1e3 * seconds(t), 0) + " ms"; }

const char* word_of(int state) {
  constexpr const char* words[] = {"idle", "running", "held", "fault", "emergency stop"};
  return state >= 1 && state <= 5 ? words[state - 1] : "?";
}

/// Of two assignments that overlap the lower one shows its variable.
const SnpxAssignment* shown_at(const RegisterMap& map, int address) {
  for (const SnpxAssignment& a : map.assignments) {
    if (address >= a.address && address < a.address + a.size) return &a;
  }
  return nullptr;
}

std::string entry_of(const SnpxAssignment& a) {
  return "$SNPX_ASG[" + std::to_string(a.slot) + "]: $ADDRESS " + std::to_string(a.address) +
         ", $SIZE " + std::to_string(a.size) + ", $VAR_NAME " + a.variable + ", $MULTIPLY " +
         std::to_string(a.multiply);
}

}  // namespace

ArmExamination::ArmExamination(Setup setup, Loop& loop)
    : setup_(std::move(setup)),
      name_(std::string(name_of(setup_.role)) + " arm"),
      codec_(setup_.map, linear_axes(*setup_.kinematics)),
      controller_clock_(setup_.map.counter_wrap),
      clock_(setup_.map.tick_period),
      controller_({.device = name_,
                   .options = {setup_.device.address, setup_.map.unit, setup_.device.timeout,
                               setup_.device.dial_timeout},
                   .first = setup_.map.status.first,
                   .count = setup_.map.status.count,
                   .period = setup_.device.status_period,
                   .when_unreachable = "is the controller on, the address that of devices.yaml, "
                                       "Modbus TCP on ($SNPX_PARAM.$NUM_MODBUS > 0)?",
                   .when_silent = "unit " + std::to_string(setup_.map.unit) +
                                  " of the map against $MODBUS_ADR; connections left "
                                  "($SNPX_PARAM.$NUM_MODBUS: a driver that runs takes two)"},
                  loop, [this](const RegisterAnswer& answer) { on_status(answer); }) {}

// ---- reading

void ArmExamination::on_status(const RegisterAnswer& answer) {
  const RegisterMap& map = setup_.map;
  if (reads_++ % command_block_every == 0) {
    controller_.link().read_registers(
        map.command.first, map.command.count,
        [this](const RegisterAnswer& block) { on_command_block(block); });
  }
  const bool first = words_.empty();
  words_ = answer.words;
  int tick_ms = 0;
  const ArmReport before = std::exchange(report_, codec_.decode(answer.words, tick_ms));
  report_.controller_time = controller_clock_.add(tick_ms);
  if (!first && report_.heartbeat != before.heartbeat) ++beats_;
  if (report_.error != 0) read_alarm();
  const Utime step = report_.controller_time - before.controller_time;
  if (!first && step == 0) {
    standstill_ = std::max(standstill_, answer.received - renewed_);
    return;
  }
  renewed_ = answer.received;
  if (!clock_.add(answer.sent, report_.controller_time, answer.received)) ++jumps_;
  if (first) return;
  ++ticks_;
  min_step_ = min_step_ == 0 ? step : std::min(min_step_, step);
}

void ArmExamination::on_command_block(const RegisterAnswer& answer) {
  if (!answer.ok()) return;  // status reads report the fault
  const auto number = [&](const RegisterField& field) {
    const int at = field.address - setup_.map.command.first;
    return static_cast<int>(std::lround(field.get(answer.words.data() + at)));
  };
  const int heartbeat = number(setup_.map.host_heartbeat);
  if (command_read_ && heartbeat != host_heartbeat_) {
    ++host_beats_;
    if (number(setup_.map.setpoint_sequence) == report_.setpoint_taken) ++echoes_;
  }
  command_read_ = true;
  host_heartbeat_ = heartbeat;
}

void ArmExamination::read_alarm() {
  if (setup_.map.alarm == 0 || std::exchange(alarm_requested_, true)) return;
  controller_.link().read_registers(
      setup_.map.alarm, alarm_words::text_end, [this](const RegisterAnswer& answer) {
        if (!answer.ok()) return;
        alarm_ = get_text(std::span(answer.words).subspan(alarm_words::text - 1));
        alarm_.erase(alarm_.find_last_not_of(' ') + 1);
      });
}

// ---- what it has shown

std::vector<Finding> ArmExamination::findings(Utime span) const {
  std::vector<Finding> list{controller_.connection()};
  if (list.front().state == State::bad) return list;
  list.push_back(register_map());
  list.push_back(controller_.timing());
  if (mismatch()) return list;  // nothing more to examine
  list.push_back(tick());
  list.push_back(heartbeat());
  if (clock_.valid()) {
    const Utime bracket = setup_.map.tick_period + controller_.round_trips().quantile(0.5);
    list.push_back(clock_finding(name_, clock_.line(), jumps_, bracket, span));
  }
  list.push_back(pose());
  list.push_back(state());
  return list;
}

Finding ArmExamination::finding(const char* topic) const {
  Finding finding;
  finding.subject = name_ + " " + topic;
  return finding;
}

std::optional<ArmExamination::Mismatch> ArmExamination::unlike(const char* name, int address,
                                                               double value, double min,
                                                               double max) const {
  if (value >= min && value <= max) return std::nullopt;
  const auto plain = [](double x) { return x == std::floor(x) ? fixed(x, 0) : shown(x); };
  const SnpxAssignment* shown_by = shown_at(setup_.map, address);
  return Mismatch{"register " + std::to_string(address) + " (" + name + ") reads " + plain(value) +
                      ", expected " + plain(min) + " to " + plain(max),
                  shown_by != nullptr ? entry_of(*shown_by) : ""};
}

std::optional<ArmExamination::Mismatch> ArmExamination::unlike(const char* name,
                                                               const RegisterField& field,
                                                               double min, double max) const {
  const double value = field.get(words_.data() + (field.address - setup_.map.status.first));
  return unlike(name, field.address, value, min, max);
}

std::optional<ArmExamination::Mismatch> ArmExamination::mismatch() const {
  const RegisterMap& map = setup_.map;
  const double counter = map.counter_wrap - 1;
  const auto word = [&](int address) {
    return static_cast<double>(words_[static_cast<std::size_t>(address - map.status.first)]);
  };
  const int valid = map.position + position_words::joints_valid - 1;
  std::vector<std::optional<Mismatch>> found{
      unlike("joints valid", valid, word(valid), 0, 1),
      unlike("state", map.state, 1, 5),
      unlike("tick", map.tick, 0, counter),
      unlike("heartbeat", map.heartbeat, 0, counter),
      unlike("set-point taken", map.setpoint_taken, 0, counter),
      unlike("override", map.speed_override, 0, 100),
      unlike("program state", map.program_state, word(map.program_state), 0, 2),
  };
  if (report_.valid) {
    for (std::size_t i = 0; i < 6; ++i) {
      const bool linear = setup_.kinematics->is_linear(static_cast<int>(i));
      const JointLimit& limits = setup_.kinematics->limits()[i];
      const std::string name = "J" + std::to_string(i + 1);
      found.push_back(
          unlike(name.c_str(), map.position + position_words::joints - 1 + 2 * static_cast<int>(i),
                 pendant_from_si(report_.joints[i], linear), pendant_from_si(limits.low, linear),
                 pendant_from_si(limits.high, linear)));
    }
  }
  const auto wrong =
      std::find_if(found.begin(), found.end(), [](const auto& one) { return one.has_value(); });
  return wrong == found.end() ? std::nullopt : *wrong;
}

Finding ArmExamination::register_map() const {
  Finding result = finding("register map");
  const std::optional<Mismatch> wrong = mismatch();
  if (!wrong) {
    result.found = "registers " + std::to_string(setup_.map.status.first) + " to " +
                   std::to_string(setup_.map.status.first + setup_.map.status.count - 1) +
                   " agree with the map; the table itself is read back by the driver when it "
                   "connects, which writes to slot 80";
    return result;
  }
  result.state = State::bad;
  result.found = wrong->found;
  result.remedy = wrong->assignment +
                  "; the programs of docs/commissioning.md keep the registers; the layout's arm is "
                  "this one (docs/arms.md)";
  return result;
}

Finding ArmExamination::tick() const {
  Finding result = finding("tick");
  if (ticks_ == 0) {
    result.state = State::bad;
    result.found = "stands still";
    result.remedy = does_logic_run;
    return result;
  }
  const Utime period = setup_.map.tick_period;
  result.found = "renewed every " + in_ms(min_step_) + " or sooner, the longest standstill " +
                 in_ms(standstill_) + " in " + std::to_string(ticks_) + " readings";
  // Reads fall on every phase of the tick: of neighbouring ones some are one tick apart. The
  // clocks' rates differ, so that a tick may be shown a millisecond longer.
  const Utime beat = setup_.device.status_period;
  if (min_step_ > std::max(period, beat) + beat / 2 + millisecond) {
    result.state = State::warning;
    result.remedy = "the map has tick_period " + in_ms(period) +
                    ": put in what is so, or ground truth claims to know the time better";
  } else if (standstill_ > setup_.device.stale_polls * beat / 2) {
    result.state = State::warning;
    result.remedy = "the driver takes it for dead after " +
                    in_ms(setup_.device.stale_polls * beat) + ": what holds the logic up?";
  }
  return result;
}

Finding ArmExamination::heartbeat() const {
  Finding result = finding("heartbeat");
  if (beats_ == 0) {
    result.state = State::bad;
    result.found = "the controller's own stands still";
    result.remedy = does_logic_run;
  } else if (host_beats_ == 0) {
    result.found =
        "the controller's own counts; no driver writes the host's, so that its echo "
        "cannot be seen";
    result.remedy = "again while a cell is up (berth up --hardware), with a third connection";
  } else if (echoes_ == 0) {
    result.state = State::bad;
    result.found =
        "the controller's own counts, but it gives the driver's set-point number never "
        "back";
    result.remedy = "the program that takes set-points does not run (docs/commissioning.md)";
  } else {
    result.found =
        "the controller's own counts; the driver's comes, and its set-point number "
        "comes back";
  }
  return result;
}

Finding ArmExamination::pose() const {
  Finding result = finding("pose");
  const std::string positions = std::string("; positions are ") +
                                (setup_.device.following_lag > 0 ? "commanded" : "measured") +
                                ", by devices.yaml";
  if (!report_.valid) {
    result.state = State::bad;
    result.found = "the controller marks its joints as not valid";
    result.remedy = "is the robot mastered and its position known?";
  } else if (const auto apart = flange_difference(report_, *setup_.kinematics); !apart) {
    result.state = State::warning;
    result.found = "of another tool than the flange, so that it is not compared" + positions;
    result.remedy = "select tool frame 0 (UTOOL_NUM), user frame 0";
  } else if (const std::string wrong = foreign_kinematics(report_, *setup_.kinematics);
             !wrong.empty()) {
    result.state = State::bad;
    result.found = wrong;
    result.remedy = "the arm's file (docs/arms.md), its mastering; tool frame 0 must be zero";
  } else {
    result.found = "the flange is " + fixed(1e3 * *apart, 2) +
                   " mm from where the kinematics put it" + positions;
  }
  return result;
}

Finding ArmExamination::state() const {
  Finding result = finding("state");
  result.found = std::string(word_of(report_.state)) + ", override " +
                 fixed(100 * report_.speed_override, 0) + " %";
  const bool fault = report_.state == static_cast<int>(ControllerState::fault) ||
                     report_.state == static_cast<int>(ControllerState::emergency_stop);
  if (report_.error != 0) {
    result.found +=
        ", error " + std::to_string(report_.error) + (alarm_.empty() ? "" : ": " + alarm_);
  }
  if (fault || report_.error != 0) {
    result.state = State::warning;
    result.remedy = "put it right at the controller and reset it";
  } else if (report_.speed_override > 0 && report_.speed_override < 1) {
    result.state = State::warning;
    result.remedy = "motions go slower on their path; 100 % for what is to be timed";
  }
  return result;
}

}  // namespace berth
