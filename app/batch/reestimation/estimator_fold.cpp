// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/reestimation/estimator_fold.h"

#include <berth/heartbeat_t.hpp>

#include "estimator/node/estimator_node.h"
#include "lcmtypes/channels.h"

namespace berth {
namespace {

constexpr char node_name[] = "estimator";

template <class Message>
bool is_of_estimator(const logs::LogEvent& event) {
  const auto message = logs::decode<Message>(event.data);
  return message && message->node == node_name;
}

Simulation::Options starting_at(Utime start) {
  Simulation::Options options;
  options.start = start;
  return options;
}

}  // namespace

EstimatorFold::EstimatorFold(const RunFiles& files, Utime start, FoldBus::Outlet outlet)
    : simulation_(starting_at(start)), bus_(std::move(outlet)) {
  node_ = make_estimator_node({node_name, files.setup.session, files.configuration_hash},
                              files.setup, bus_, simulation_.make_loop());
}

void EstimatorFold::take(const logs::LogEvent& event) {
  simulation_.run_until(event.utime);
  if (is_input(event)) bus_.deliver(event.channel, event.data);
}

bool EstimatorFold::is_input(const logs::LogEvent& event) {
  return event.channel == channels::scan_data || event.channel == channels::estimator_command ||
         event.channel == channels::inertial_motion;
}

bool EstimatorFold::is_output(const logs::LogEvent& event) {
  if (event.channel == channels::heartbeat) return is_of_estimator<heartbeat_t>(event);
  if (event.channel == channels::node_status) return is_of_estimator<node_status_t>(event);
  if (event.channel == channels::event) return is_of_estimator<event_t>(event);
  return event.channel == channels::pose_estimate || event.channel == channels::scan_request ||
         event.channel == channels::estimator_state ||
         event.channel == channels::estimator_diagnostics;
}

}  // namespace berth
