// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/preconditions.h"

#include "common/core/text.h"

namespace berth::procedures {
namespace {

precondition_t item(const std::string& name, bool met, const std::string& reason) {
  precondition_t result;
  result.name = name;
  result.met = met;
  result.reason = reason;
  return result;
}

precondition_t lease(const TestbedLink& testbed) {
  const auto& state = testbed.state();
  const std::string holder = state ? state->lease_holder : "";
  const std::string by = holder.empty() ? "nobody has it" : holder + " has it";
  return item("lease", testbed.has_lease(), state ? by : "the testbed is not heard of");
}

precondition_t testbed_ready(const TestbedLink& testbed, bool going_on) {
  const auto& state = testbed.state();
  if (!state) return item("testbed", false, "not heard of");
  const bool ready =
      state->state == testbed_state_t::IDLE || (going_on && state->state == testbed_state_t::HELD);
  const LiveQuantity* words = live_quantity_named("testbed");
  return item("testbed", ready,
              words->text(state->state) + (state->reason.empty() ? "" : ": " + state->reason));
}

void add_facility(std::vector<precondition_t>& list, const Live& live) {
  const auto& facility = live.facility();
  const bool known = facility && facility->valid;
  const std::string silent = facility ? "the PLC does not answer: " + facility->reason
                                      : std::string("the facility is not heard of");
  const auto circuit = [&](const char* name, bool closed) {
    list.push_back(item(name, known && closed, !known ? silent : closed ? "closed" : "open"));
  };
  circuit("E-stop chain", known && facility->estop_chain_closed);
  circuit("fence", known && facility->fence_closed);
}

precondition_t lidar_ready(const Live& live) {
  const auto& lidar = live.lidar();
  if (!lidar) return item("LIDAR", false, "not heard of");
  const bool ready = lidar->state == lidar_state_t::IDLE || lidar->state == lidar_state_t::SCANNING;
  return item("LIDAR", ready,
              live_quantity_named("lidar")->text(lidar->state) +
                  (lidar->reason.empty() ? "" : ": " + lidar->reason));
}

}  // namespace

std::vector<precondition_t> preconditions(const NodeWatch& nodes, const Bench& bench,
                                          bool going_on) {
  std::vector<precondition_t> list = nodes.preconditions();
  list.push_back(lease(bench.testbed));
  list.push_back(testbed_ready(bench.testbed, going_on));
  if (nodes.requires_node("facility-driver")) add_facility(list, bench.live);
  if (nodes.requires_node("lidar-driver")) list.push_back(lidar_ready(bench.live));
  return list;
}

std::string unmet(const std::vector<precondition_t>& preconditions) {
  std::string text;
  for (const precondition_t& p : preconditions) {
    if (!p.met) text += (text.empty() ? "" : "; ") + p.name + ": " + p.reason;
  }
  return text;
}

void RestWatch::look(const Bench& bench) {
  constexpr double slow = 2e-3;           // m/s
  constexpr double slow_turn = 1.745e-3;  // rad/s: a tenth of a degree
  const auto truth = bench.live.truth();
  if (rest_ || !truth) return;
  if (truth->velocity.linear.norm() < slow && truth->velocity.angular.norm() < slow_turn) {
    rest_ = truth->pose;
  }
}

precondition_t RestWatch::precondition(const Bench& bench) const {
  const auto truth = bench.live.truth();
  if (!truth) return item("relative pose", false, "there is no ground truth to check it by");
  if (!rest_) return item("relative pose", false, "has not come to rest yet");
  const double moved = distance(*rest_, truth->pose);
  const double turned = angle_between(*rest_, truth->pose);
  const std::string by =
      fixed(1e3 * moved, 1) + " mm and " + fixed(degrees(turned), 2) + " deg from where it stood";
  return item("relative pose", moved <= most_distance && turned <= most_angle, by);
}

}  // namespace berth::procedures
