// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/engine/preconditions.h"

#include "common/core/text.h"

namespace berth::procedures {
namespace {

precondition_t lease(const TestbedLink& testbed) {
  const auto& state = testbed.state();
  const std::string holder = state ? state->lease_holder : "";
  const std::string by = holder.empty() ? "no commander has it" : holder + " has it";
  return make_precondition("lease", testbed.has_lease(),
                           state ? by : "nothing received from the testbed");
}

precondition_t testbed_ready(const TestbedLink& testbed, bool going_on) {
  const auto& state = testbed.state();
  if (!state) return make_precondition("testbed", false, "nothing received");
  const bool ready =
      state->state == testbed_state_t::IDLE || (going_on && state->state == testbed_state_t::HELD);
  const LiveQuantity* words = live_quantity_named("testbed");
  return make_precondition(
      "testbed", ready,
      words->text(state->state) + (state->reason.empty() ? "" : ": " + state->reason));
}

void add_facility(std::vector<precondition_t>& list, const RunMessages& live) {
  const auto& facility = live.facility;
  const bool known = facility && facility->valid;
  const std::string silent = facility ? "the PLC does not answer: " + facility->reason
                                      : std::string("nothing received from the facility driver");
  const auto circuit = [&](const char* name, bool closed) {
    list.push_back(make_precondition(name, known && closed,
                                     !known   ? silent
                                     : closed ? "closed"
                                              : "open"));
  };
  circuit("E-stop chain", known && facility->estop_chain_closed);
  circuit("fence", known && facility->fence_closed);
}

precondition_t lidar_ready(const RunMessages& live) {
  const auto& lidar = live.lidar;
  if (!lidar) return make_precondition("LIDAR", false, "nothing received");
  const bool ready = lidar->state == lidar_state_t::IDLE || lidar->state == lidar_state_t::SCANNING;
  return make_precondition("LIDAR", ready,
                           live_quantity_named("lidar")->text(lidar->state) +
                               (lidar->reason.empty() ? "" : ": " + lidar->reason));
}

}  // namespace

precondition_t make_precondition(const std::string& name, bool met, const std::string& reason) {
  precondition_t result;
  result.name = name;
  result.met = met;
  result.reason = reason;
  return result;
}

precondition_t room_on_disk(const std::filesystem::path& folder) {
  constexpr double gigabyte = 1e9;
  std::error_code error;
  const auto space = std::filesystem::space(folder, error);
  if (error) return make_precondition("disk", false, folder.string() + ": " + error.message());
  const double free = static_cast<double>(space.available) / gigabyte;
  return make_precondition("disk", free > 2, fixed(free, 1) + " GB free");
}

std::vector<precondition_t> preconditions(const NodeWatch& nodes, const Bench& bench,
                                          bool going_on) {
  std::vector<precondition_t> list = nodes.preconditions(going_on);
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
  // Truth's noise alone gives a velocity of some mm/s: still is a pose that stays in one place for
  // this time.
  constexpr Utime stillness = 500 * millisecond;
  constexpr double still_distance = 2e-3;    // m
  constexpr double still_angle = 1.7453e-3;  // rad: a tenth of a degree
  const auto truth = bench.live.truth();
  if (rest_ || !truth) return;
  if (!place_ || distance(place_->pose, truth->pose) > still_distance ||
      angle_between(place_->pose, truth->pose) > still_angle) {
    place_ = *truth;
  }
  if (truth->utime - place_->utime >= stillness) rest_ = place_->pose;
}

precondition_t RestWatch::precondition(const Bench& bench) const {
  const auto truth = bench.live.truth();
  if (!truth)
    return make_precondition("relative pose", false, "there is no ground truth to check it by");
  if (!rest_) return make_precondition("relative pose", false, "has not come to rest yet");
  const double moved = distance(*rest_, truth->pose);
  const double turned = angle_between(*rest_, truth->pose);
  const std::string by =
      fixed(1e3 * moved, 1) + " mm and " + fixed(degrees(turned), 2) + " deg from where it stood";
  return make_precondition("relative pose", moved <= max_distance && turned <= max_angle, by);
}

}  // namespace berth::procedures
