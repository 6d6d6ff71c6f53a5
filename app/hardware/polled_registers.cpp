// SPDX-License-Identifier: BSD-3-Clause
#include "app/hardware/polled_registers.h"

namespace berth {

PolledRegisters::PolledRegisters(Setup setup, Loop& loop,
                                 std::function<void(const RegisterAnswer&)> answered)
    : setup_(std::move(setup)),
      loop_(loop),
      answered_(std::move(answered)),
      link_(make_register_link(loop, setup_.options,
                               [this](bool up, const std::string& why) {
                                 connected_ = connected_ || up;
                                 if (!up) lost_ = why;
                               })),
      timer_(loop.every(setup_.period, [this] { poll(); })) {}

PolledRegisters::~PolledRegisters() { loop_.cancel(timer_); }

void PolledRegisters::poll() {
  if (under_way_ || !link_->connected()) return;
  under_way_ = true;
  link_->read_registers(setup_.first, setup_.count, [this](const RegisterAnswer& answer) {
    under_way_ = false;
    if (!answer.ok()) return round_trips_.miss(answer.error);
    round_trips_.add(answer.received - answer.sent);
    answered_(answer);
  });
}

Finding PolledRegisters::connection() const {
  Finding finding;
  finding.subject = setup_.device + " connection";
  finding.found = setup_.options.address;
  if (!connected_) {
    finding.state = Finding::State::bad;
    finding.found += lost_.empty() ? ": nobody answers" : ": " + lost_;
    finding.remedy = setup_.when_unreachable;
  } else if (round_trips_.answered() == 0) {
    finding.state = Finding::State::bad;
    finding.found += " takes connections, but answers no read: " +
                     (round_trips_.why().empty() ? lost_ : round_trips_.why());
    finding.remedy = setup_.when_silent;
  } else {
    finding.found += " answers as unit " + std::to_string(setup_.options.unit);
  }
  return finding;
}

Finding PolledRegisters::timing() const {
  return round_trips_.finding(setup_.device, setup_.period, setup_.options.timeout);
}

}  // namespace berth
