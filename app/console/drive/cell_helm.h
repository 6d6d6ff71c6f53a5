// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <berth/facility_state_t.hpp>
#include <berth/testbed_state_t.hpp>
#include <memory>
#include <optional>
#include <string>

#include "common/bus/bus.h"
#include "procedures/engine/facility_link.h"
#include "procedures/engine/testbed_link.h"

namespace berth::console {

/// Steers a cell in which no procedure runs, by the testbed's lease: for one operator at a time.
/// Whoever else commands the testbed keeps it.
class CellHelm final : private procedures::Actions {
 public:
  CellHelm(Bus& bus, Loop& loop, std::int64_t session)
      : bus_(bus), loop_(loop), session_(session) {}

  void on(const testbed_state_t& state);
  void on(const facility_state_t& state);
  /// At 20 Hz: repeats what has not been acknowledged, and keeps the lease.
  void tick();

  /// Asks for the lease, and keeps it until it is given back.
  void take(const std::string& who);
  void give_back();
  /// Whose lease is asked for or held; empty: nobody's.
  const std::string& taken_for() const { return taken_for_; }
  bool has_lease() const { return links_ && links_->testbed.has_lease(); }
  /// Who commands the testbed, as it says.
  std::string lease_holder() const { return testbed_ ? testbed_->lease_holder : ""; }

  /// Brings what moves to rest; needs no lease. Said until the testbed acknowledges it.
  void hold(const std::string& who);
  /// The next two need it.
  void set_speed(double override);
  /// @throws InputError for words that are none of lamps, or when the facility does not answer.
  void set_lamps(const std::string& text);

  const std::optional<testbed_state_t>& testbed() const { return testbed_; }

 private:
  struct Links {
    procedures::TestbedLink testbed;
    procedures::FacilityLink facility;
  };

  procedures::Commander commander(const std::string& who) const;
  void send(const testbed_command_t& command) override;
  void send(const estimator_command_t&) override {}
  void send(const facility_command_t& command) override;
  void send(const injection_t&) override {}
  void event(std::int8_t, const std::string&, const std::string&) override {}

  Bus& bus_;
  Loop& loop_;
  std::int64_t session_;
  std::string taken_for_;
  std::unique_ptr<Links> links_;
  std::optional<procedures::TestbedLink> hold_;  // by which a HOLD was asked for last
  std::optional<testbed_state_t> testbed_;
  std::optional<facility_state_t> facility_;
};

}  // namespace berth::console
