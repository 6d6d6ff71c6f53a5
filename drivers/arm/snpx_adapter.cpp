// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/snpx_adapter.h"

#include <algorithm>
#include <cmath>

namespace berth {
namespace {

constexpr const char* field_names[] = {"$ADDRESS", "$SIZE", "$VAR_NAME", "$MULTIPLY"};

constexpr Utime recheck_period = 5 * second;

}  // namespace

const SnpxAssignment& AssignmentCheck::assignment() const {
  return map_.assignments[step_ / fields];
}

AssignmentCheck::FieldKind AssignmentCheck::field() const {
  return static_cast<FieldKind>(step_ % fields);
}

void AssignmentCheck::next() {
  if (!map_.bootstrap) return finish(Result::not_offered, "the map has no bootstrap window");
  if (step_ == map_.assignments.size() * fields) return finish(Result::agrees, "");
  const RegisterMap::Bootstrap& window = *map_.bootstrap;
  const bool text = field() == FieldKind::name;
  shown_.assign(RegisterMap::Bootstrap::words, 0);
  put_int32(window.peephole, &shown_[0]);
  put_int32(text ? window.name_words : 2, &shown_[window.size_at]);
  put_text("$SNPX_ASG[" + std::to_string(assignment().slot) + "]." +
               field_names[static_cast<int>(field())],
           std::span(shown_).subspan(window.name_at, window.name_words));
  put_float(text ? -1.0f : 1.0f, &shown_[window.multiply_at]);
  link_.write_registers(window.first, shown_, [self = weak_from_this()](const RegisterAnswer& a) {
    if (const auto check = self.lock()) check->on_shown(a);
  });
}

void AssignmentCheck::on_shown(const RegisterAnswer& answer) {
  if (answer.exception != 0) return finish(Result::not_offered, answer.error);
  if (!answer.ok()) return finish(Result::failed, answer.error);
  const RegisterMap::Bootstrap& window = *map_.bootstrap;
  const auto weak = weak_from_this();
  if (step_ == 0) {  // registers without an assignment take any write and read as zeros
    link_.read_registers(window.first, window.words, [weak](const RegisterAnswer& a) {
      if (const auto check = weak.lock()) check->on_window(a);
    });
  } else {
    read_value();
  }
}

void AssignmentCheck::read_value() {
  link_.read_registers(map_.bootstrap->peephole,
                       field() == FieldKind::name ? RegisterMap::Bootstrap::name_words : 2,
                       [weak = weak_from_this()](const RegisterAnswer& a) {
                         if (const auto check = weak.lock()) check->on_value(a);
                       });
}

void AssignmentCheck::on_window(const RegisterAnswer& answer) {
  if (!answer.ok()) return finish(Result::failed, answer.error);
  if (!std::equal(answer.words.begin(), answer.words.end(), shown_.begin())) {
    return finish(Result::not_offered, "registers " + std::to_string(map_.bootstrap->first) +
                                           " and following do not show slot 80");
  }
  read_value();
}

void AssignmentCheck::on_value(const RegisterAnswer& answer) {
  if (!answer.ok()) return finish(Result::failed, answer.error);
  std::string found;
  std::string expected;
  if (field() == FieldKind::name) {
    found = get_text(answer.words);
    expected = assignment().variable;
  } else {
    found = std::to_string(get_int32(answer.words.data()));
    expected = std::to_string(field() == FieldKind::address ? assignment().address
                              : field() == FieldKind::size  ? assignment().size
                                                            : assignment().multiply);
  }
  if (found != expected) {
    return finish(Result::differs, "$SNPX_ASG[" + std::to_string(assignment().slot) + "]." +
                                       field_names[static_cast<int>(field())] + " is '" + found +
                                       "', the map has '" + expected + "'");
  }
  ++step_;
  next();
}

void AssignmentCheck::finish(Result result, const std::string& text) {
  const Done done = std::move(done_);
  if (done) done(result, text);
}

SnpxAdapter::SnpxAdapter(const ArmDevice& device, const RegisterMap& map,
                         const ArmKinematics& kinematics, Loop& loop)
    : codec_(map, linear_axes(kinematics)),
      options_{device.address, map.unit, device.timeout, device.dial_timeout},
      capabilities_{map.tick_period, map.counter_wrap},
      loop_(loop),
      clock_(map.counter_wrap) {}

SnpxAdapter::~SnpxAdapter() {
  loop_.cancel(recheck_timer_);
  for (const auto& [coil, timer] : pulse_timers_) loop_.cancel(timer);
}

void SnpxAdapter::start(Events events) {
  events_ = std::move(events);
  reader_ = make_register_link(
      loop_, options_, [this](bool up, const std::string& reason) { on_connection(up, reason); });
  writer_ = make_register_link(loop_, options_, [this](bool up, const std::string& reason) {
    events_.changed(up ? Change::setpoints_open : Change::setpoints_closed, reason);
  });
}

// ---- connection ----

void SnpxAdapter::on_connection(bool connected, const std::string& reason) {
  if (connected) {
    events_.changed(Change::connected, "");
    return check_assignments();
  }
  ready_ = false;
  check_.reset();
  events_.changed(Change::lost, reason);
}

void SnpxAdapter::check_assignments() {
  recheck_timer_ = 0;
  check_ = std::make_shared<AssignmentCheck>(
      *reader_, map(), [this](AssignmentCheck::Result result, const std::string& text) {
        on_checked(result, text);
      });
  check_->start();
}

void SnpxAdapter::on_checked(AssignmentCheck::Result result, const std::string& text) {
  using Result = AssignmentCheck::Result;
  if (result == Result::failed) return;  // the lost connection is reported by itself
  if (result == Result::differs) {
    events_.changed(Change::wrong, "register map: " + text);
    recheck_timer_ = loop_.after(recheck_period, [this] { check_assignments(); });
    return;
  }
  if (result == Result::not_offered) events_.changed(Change::not_verified, text);
  // Ends pulses that a lost connection has interrupted.
  for (const int coil : {map().start_coil, map().hold_coil, map().reset_coil}) {
    if (pulse_timers_.count(coil) == 0) {
      reader_->write_coil(coil, false, [](const RegisterAnswer&) {});
    }
  }
  clock_.clear();
  alarm_of_ = 0;
  alarm_.clear();
  ready_ = true;
  events_.changed(Change::ready, "");
}

// ---- status ----

void SnpxAdapter::poll() {
  reader_->read_registers(map().status.first, map().status.count,
                          [this](const RegisterAnswer& answer) { on_status(answer); });
}

void SnpxAdapter::on_status(const RegisterAnswer& answer) {
  if (!answer.ok()) return events_.missed(answer.error, answer.exception != 0);
  int tick_ms = 0;
  ArmReport report = codec_.decode(answer.words, tick_ms);
  report.controller_time = clock_.add(tick_ms);
  report.sent = answer.sent;
  report.received = answer.received;
  read_alarm(report.error);
  report.alarm = alarm_;
  events_.report(report);
}

/// Once for each error; between two status reads.
void SnpxAdapter::read_alarm(int error) {
  if (map().alarm == 0 || error == alarm_of_) return;
  alarm_of_ = error;
  alarm_.clear();
  if (error == 0) return;
  reader_->read_registers(
      map().alarm, alarm_words::text_end, [this, error](const RegisterAnswer& answer) {
        if (error != alarm_of_) return;
        if (!answer.ok()) alarm_of_ = 0;  // at the next report again
        if (!answer.ok()) return;
        alarm_ = get_text(std::span(answer.words).subspan(alarm_words::text - 1));
        alarm_.erase(alarm_.find_last_not_of(' ') + 1);
      });
}

// ---- orders ----

void SnpxAdapter::send(const ArmOrder& order, Done done) {
  heartbeat_ = (heartbeat_ + 1) % map().counter_wrap;
  writer_->write_registers(
      map().command.first, codec_.encode(order, heartbeat_),
      [done = std::move(done)](const RegisterAnswer& answer) { done(answer.error); });
}

void SnpxAdapter::release() {
  const auto holding = pulse_timers_.find(map().hold_coil);
  if (holding == pulse_timers_.end()) return;
  loop_.cancel(holding->second);
  pulse_timers_.erase(holding);
  for (RegisterLink* link : {reader_.get(), writer_.get()}) {  // behind the hold, on whichever link
    link->write_coil(map().hold_coil, false, [](const RegisterAnswer&) {});
  }
}

int SnpxAdapter::pulse(int coil, const Done& done) {
  const int copies = write_coil(coil, true, done);
  if (const auto lasting = pulse_timers_.find(coil); lasting != pulse_timers_.end()) {
    loop_.cancel(lasting->second);
  }
  pulse_timers_[coil] = loop_.after(map().pulse, [this, coil] {
    pulse_timers_.erase(coil);
    write_coil(coil, false, {});
  });
  return copies;
}

/// Over a link that is idle; where none is, over each that is up, so that a hanging one delays
/// nothing.
int SnpxAdapter::write_coil(int coil, bool on, const Done& done) {
  const auto is_free = [](const RegisterLink& link) { return link.connected() && link.idle(); };
  const bool any_free = is_free(*reader_) || is_free(*writer_);
  int copies = 0;
  for (RegisterLink* link : {reader_.get(), writer_.get()}) {
    if (any_free ? !is_free(*link) : !link->connected()) continue;
    ++copies;
    link->write_coil(
        coil, on,
        [done](const RegisterAnswer& answer) {
          if (done) done(answer.error);
        },
        on ? RegisterLink::Urgency::first : RegisterLink::Urgency::normal);
    if (any_free) break;
  }
  return copies;
}

}  // namespace berth
