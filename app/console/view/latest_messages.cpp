// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/latest_messages.h"

#include <algorithm>
#include <berth/heartbeat_t.hpp>

#include "lcmtypes/channels.h"

namespace berth::console {
namespace {

template <class Message>
void keep(const logs::LogEvent& event, std::optional<Message>& place) {
  if (auto message = logs::decode<Message>(event.data)) place = std::move(message);
}

}  // namespace

void LatestMessages::take(const logs::LogEvent& event) {
  const std::string_view channel = event.channel;
  if (channel == channels::arm_state_replica) {
    keep(event, replica_arm);
  } else if (channel == channels::arm_state_sensor) {
    keep(event, sensor_arm);
  } else if (channel == channels::facility_state) {
    keep(event, facility);
  } else if (channel == channels::lidar_state) {
    keep(event, lidar);
  } else if (channel == channels::pose_estimate) {
    keep(event, estimate);
  } else if (channel == channels::procedure_state) {
    keep(event, procedure);
  } else if (channel == channels::testbed_state) {
    keep(event, testbed);
  } else if (channel == channels::ground_truth) {
    if (const auto message = logs::decode<ground_truth_t>(event.data)) {
      truth = evaluation::sample_of(*message);
    }
  } else if (channel == channels::node_status) {
    if (auto message = logs::decode<node_status_t>(event.data)) {
      nodes[message->node] = std::move(*message);
    }
  } else if (channel == channels::heartbeat) {
    if (const auto message = logs::decode<heartbeat_t>(event.data)) {
      beats[message->node] = event.utime;
    }
  }
}

std::optional<evaluation::TruthSample> LatestMessages::truth_at(Utime now) const {
  return truth && now - truth->utime <= second ? truth : std::nullopt;
}

std::optional<Joints> joints_of(const std::optional<arm_state_t>& state) {
  if (!state || !state->valid) return std::nullopt;
  Joints joints{};
  std::copy(std::begin(state->reported_joint), std::end(state->reported_joint), joints.begin());
  return joints;
}

}  // namespace berth::console
