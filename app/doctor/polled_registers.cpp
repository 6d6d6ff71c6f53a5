// SPDX-License-Identifier: BSD-3-Clause
#include "app/doctor/polled_registers.h"

#include "common/core/statistics.h"
#include "common/core/text.h"

namespace berth {

Utime RoundTrips::quantile(double share) const {
  return utime_from_seconds(berth::quantile(times_, share));
}

Finding RoundTrips::finding(const std::string& device, Utime period, Utime timeout) const {
  const auto in_ms = [](Utime t) { return fixed(1e3 * seconds(t), 2) + " ms"; };
  Finding finding;
  finding.subject = device + " round trips";
  finding.found = "median " + in_ms(quantile(0.5)) + ", p99 " + in_ms(quantile(0.99)) + ", max " +
                  in_ms(quantile(1)) + " of " + std::to_string(answered()) + " reads";
  if (missed_ > 0) {
    finding.state = Finding::State::warning;
    finding.found += ", " + std::to_string(missed_) + " without an answer: " + why_;
    finding.remedy =
        "a quiet network of its own for the cell; every miss is a hole in ground truth";
  } else if (quantile(0.5) > period) {
    finding.state = Finding::State::bad;
    finding.remedy = "the driver reads every " + in_ms(period) +
                     ": a faster network, or a lower rate in devices.yaml";
  } else if (quantile(0.99) > timeout / 2) {
    finding.state = Finding::State::warning;
    finding.remedy = "an answer is given up after " + in_ms(timeout) + " (devices.yaml: timeout)";
  }
  return finding;
}

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
    finding.found += lost_.empty() ? ": no answer" : ": " + lost_;
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
