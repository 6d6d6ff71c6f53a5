// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/bus/bus.h"
#include "lcmtypes/latest_messages.h"
#include "procedures/engine/links.h"

namespace berth::console {

/// Commands to a cell in which no procedure runs, by the testbed's lease: for one operator at a
/// time. Another holder of the lease keeps it.
class CellClient final : private procedures::Actions {
 public:
  /// accepted, refused or unanswered, with the reason; called once, later.
  using Done = std::function<void(CommandStatus, const std::string& reason)>;

  /// Make it before the bus starts.
  CellClient(Bus& bus, Loop& loop, std::int64_t session);

  /// At 20 Hz: repeats what has not been answered, and keeps the lease.
  void tick();

  /// Requests the lease, and keeps it until it is given back.
  void take(const std::string& operator_name);
  void give_back();
  /// Operator for whom the lease is requested or held; empty: none.
  const std::string& taken_for() const { return taken_for_; }
  bool has_lease() const { return links_ && links_->testbed.has_lease(); }
  /// The testbed's commander, as it reports.
  std::string lease_holder() const { return latest_.testbed ? latest_.testbed->lease_holder : ""; }

  /// Brings what moves to rest; needs no lease. Repeated until the testbed answers, also after
  /// done is called with that it has not within 2 s.
  void hold(const std::string& operator_name, Done done);
  /// The next two need the lease.
  void set_speed(double override, Done done);
  /// @throws InputError for words that are none of lamps, or when the facility does not answer.
  void set_lamps(const std::string& text, Done done);

  const std::optional<testbed_state_t>& testbed() const { return latest_.testbed; }

 private:
  struct Links {
    procedures::TestbedLink testbed;
    procedures::FacilityLink facility;
  };
  struct Waiting {
    Done done;
    Utime since = 0;
  };

  template <class Message>
  void receive(const char* channel);
  void on(const testbed_state_t& state);
  void on(const facility_state_t& state);
  void on(const command_answers_t& facility);
  void wait(Waiting& waiting, Done done);
  static void end(Waiting& waiting, CommandStatus status, const std::string& reason = "");
  procedures::Actions& actions() { return *this; }
  Commander commander(const std::string& operator_name) const;
  void send(const testbed_command2_t& command) override;
  void send(const estimator_command_t&) override {}
  void send(const facility_command_t& command) override;
  void send(const injection_t&) override {}
  void send(const verdict_basis_t&) override {}
  void event(std::int8_t, const std::string&, const std::string&) override {}

  Bus& bus_;
  Loop& loop_;
  std::int64_t session_;
  std::string taken_for_;
  std::unique_ptr<Links> links_;
  std::optional<procedures::TestbedLink> hold_;  // by which a HOLD was requested last
  Waiting hold_waiting_;
  Waiting speed_waiting_;
  Waiting lamps_waiting_;
  LatestMessages latest_;
};

}  // namespace berth::console
