// SPDX-License-Identifier: BSD-3-Clause
#include "app/hardware/round_trips.h"

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
    finding.remedy = "the driver asks every " + in_ms(period) +
                     ": a faster network, or a lower rate in devices.yaml";
  } else if (quantile(0.99) > timeout / 2) {
    finding.state = Finding::State::warning;
    finding.remedy = "an answer is given up after " + in_ms(timeout) + " (devices.yaml: timeout)";
  }
  return finding;
}

}  // namespace berth
