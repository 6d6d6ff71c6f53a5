// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "app/doctor/finding.h"
#include "common/bus/loop.h"
#include "drivers/registers/register_link.h"

namespace berth {

/// Response times of a device.
class RoundTrips {
 public:
  void add(Utime time) { times_.push_back(seconds(time)); }
  /// A read without an answer, with the reason.
  void miss(const std::string& why) {
    ++missed_;
    why_ = why;
  }
  std::size_t answered() const { return times_.size(); }
  /// Of the newest miss.
  const std::string& why() const { return why_; }
  /// Time within which this share of the reads (0.5: half of them) was answered. @pre answered() >
  /// 0
  Utime quantile(double share) const;

  /// period: at which the driver reads; timeout: after which it gives up waiting for an answer.
  Finding finding(const std::string& device, Utime period, Utime timeout) const;

 private:
  std::vector<double> times_;  // s
  std::size_t missed_ = 0;
  std::string why_;
};

/// A block of a device's registers, read at its driver's pace.
class PolledRegisters {
 public:
  struct Setup {
    std::string device;  ///< its name in findings
    RegisterLink::Options options{};
    int first = 1;
    int count = 0;
    Utime period = 0;
    std::string when_unreachable;  ///< what to look at then
    std::string when_silent;       ///< the same of one that takes connections and answers nothing
  };

  /// answered: of each read that was.
  PolledRegisters(Setup setup, Loop& loop, std::function<void(const RegisterAnswer&)> answered);
  ~PolledRegisters();
  PolledRegisters(const PolledRegisters&) = delete;
  PolledRegisters& operator=(const PolledRegisters&) = delete;

  RegisterLink& link() { return *link_; }
  const RoundTrips& round_trips() const { return round_trips_; }
  /// Bad: nothing was ever answered.
  Finding connection() const;
  /// @pre something was answered
  Finding timing() const;

 private:
  void poll();

  Setup setup_;
  Loop& loop_;
  std::function<void(const RegisterAnswer&)> answered_;
  RoundTrips round_trips_;
  std::string lost_;  // why
  bool connected_ = false;
  bool under_way_ = false;
  std::unique_ptr<RegisterLink> link_;
  Loop::TimerId timer_;
};

}  // namespace berth
