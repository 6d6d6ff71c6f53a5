// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/latest_messages.h"

#include <berth/heartbeat_t.hpp>

#include "lcmtypes/channels.h"

namespace berth::console {
namespace {

template <class Message>
void keep(const logs::LogEvent& event, const char* channel, std::optional<Message>& latest) {
  if (auto message = logs::decode<Message>(event, channel)) latest = std::move(message);
}

}  // namespace

void LatestMessages::take(const logs::LogEvent& event) {
  keep(event, channels::arm_state_replica, replica_arm);
  keep(event, channels::arm_state_sensor, sensor_arm);
  keep(event, channels::facility_state, facility);
  keep(event, channels::lidar_state, lidar);
  keep(event, channels::pose_estimate, estimate);
  keep(event, channels::procedure_state, procedure);
  keep(event, channels::testbed_state, testbed);
  if (const auto message = logs::decode<ground_truth_t>(event, channels::ground_truth)) {
    truth = evaluation::sample_of(*message);
  } else if (auto status = logs::decode<node_status_t>(event, channels::node_status)) {
    nodes[status->node] = std::move(*status);
  } else if (const auto beat = logs::decode<heartbeat_t>(event, channels::heartbeat)) {
    beats[beat->node] = event.utime;
  }
}

std::optional<evaluation::TruthSample> LatestMessages::truth_at(Utime now) const {
  return truth && now - truth->utime <= second ? truth : std::nullopt;
}

}  // namespace berth::console
