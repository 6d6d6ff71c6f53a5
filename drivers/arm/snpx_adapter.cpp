// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/arm/snpx_adapter.h"

namespace berth {
namespace {

constexpr Utime recheck_period = 5 * second;

}  // namespace

SnpxAdapter::SnpxAdapter(const ArmDevice& device, const RegisterMap& map,
                         const ArmKinematics& kinematics, Loop& loop)
    : wire_(map, linear_axes(kinematics)),
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
  // A pulse that a lost connection cut short would be one still.
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
  ArmReport report = wire_.decode(answer.words, tick_ms);
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
      map().command.first, wire_.encode(order, heartbeat_),
      [done = std::move(done)](const RegisterAnswer& answer) { done(answer.error); });
}

void SnpxAdapter::release() {
  const auto holding = pulse_timers_.find(map().hold_coil);
  if (holding == pulse_timers_.end()) return;
  loop_.cancel(holding->second);
  pulse_timers_.erase(holding);
  for (RegisterLink* link : {reader_.get(), writer_.get()}) {  // behind it, whichever took it
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

/// Over a link that has nothing under way. Where none is free over each that is up: one that hangs
/// keeps nothing back.
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
