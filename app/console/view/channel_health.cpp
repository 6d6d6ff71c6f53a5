// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/channel_health.h"

#include <array>
#include <berth/estimator_diagnostics_t.hpp>
#include <berth/heartbeat_t.hpp>

#include "evaluation/run/run_record.h"
#include "lcmtypes/channels.h"
#include "logs/types/lcm_type.h"

namespace berth::console {
namespace {

/// Which node writes a channel alone; by its first one a node's rate and latency are shown.
struct Writer {
  const char* node;
  const char* channel;
};
constexpr std::array writers = {
    Writer{"arm-driver-replica", channels::arm_state_replica},
    Writer{"arm-driver-sensor", channels::arm_state_sensor},
    Writer{"estimator", channels::pose_estimate},
    Writer{"estimator", channels::estimator_state},
    Writer{"estimator", channels::estimator_diagnostics},
    Writer{"estimator", channels::scan_request},
    Writer{"facility-driver", channels::facility_state},
    Writer{"facility-driver", channels::facility_answers},
    Writer{"lidar-driver", channels::lidar_state},
    Writer{"lidar-driver", channels::scan_data},
    Writer{"testbed", channels::ground_truth},
    Writer{"testbed", channels::testbed_state},
    Writer{"testbed", channels::setpoint_latency},
    Writer{"testbed", channels::arm_command_replica},
    Writer{"testbed", channels::arm_command_sensor},
    Writer{"procedure", channels::procedure_state},
    Writer{"procedure", channels::procedure_answers},
    Writer{"procedure", channels::operator_control},
    Writer{"procedure", channels::run_info},
    Writer{"simulated-cell", channels::injection_state},
};

constexpr double smoothing = 0.1;  // of a new latency in the mean

bool begins_with_utime(const logs::StructType& type) {
  return !type.fields.empty() && type.fields[0].name == "utime" &&
         type.fields[0].kind == logs::Kind::int64 && type.fields[0].dimensions.empty();
}

void blend(std::map<std::string, double>& means, const std::string& name, double value) {
  const auto [place, is_first] = means.try_emplace(name, value);
  if (!is_first) place->second += smoothing * (value - place->second);
}

}  // namespace

void ChannelHealth::take(const logs::LogEvent& event) {
  spy_.take(event.utime, std::string(event.channel), event.data);
  count_share(event);
  measure_latency(event);
}

void ChannelHealth::count_share(const logs::LogEvent& event) {
  const auto count = [&](const std::string& node, std::int64_t session, std::int64_t seq) {
    Share& share = shares_[{node, std::string(event.channel)}];
    if (share.session != session) share = {{}, session};
    share.counter.take(seq);
  };
  if (const auto beat = logs::decode<heartbeat_t>(event, channels::heartbeat)) {
    count(beat->node, beat->session, beat->seq);
  } else if (const auto m = logs::decode<event_t>(event, channels::event)) {
    count(m->node, m->session, m->seq);
  }
}

void ChannelHealth::measure_latency(const logs::LogEvent& event) {
  if (event.channel == channels::estimator_diagnostics) {
    // An estimate is of its scan's time: what counts is how long after the last return it came.
    const auto message = logs::decode<estimator_diagnostics_t>(event.data);
    const auto latency = message ? evaluation::latency_in(*message) : std::nullopt;
    if (latency) blend(latencies_, channels::pose_estimate, seconds(*latency));
    return;
  }
  if (event.channel == channels::pose_estimate || event.data.size() < 16) return;
  const logs::StructType* type = types_->type_of(event.data);
  if (type == nullptr || !begins_with_utime(*type)) return;
  const Utime utime = logs::wire::signed_of<8>(event.data.data() + 8);
  blend(latencies_, std::string(event.channel), seconds(event.utime - utime));
}

double ChannelHealth::rate_of(const std::string& channel, Utime now) const {
  const auto found = spy_.channels().find(channel);
  return found == spy_.channels().end() ? 0 : found->second.rate_hz(now);
}

std::string ChannelHealth::channels_json(Utime now) const {
  Json list = Json::array();
  for (const auto& [name, channel] : spy_.channels()) {
    const auto& tally = channel.tally;
    const logs::StructType* type = tally.type();
    list.push_back({{"channel", name},
                    {"type", type == nullptr ? "" : logs::short_name(*type)},
                    {"rate_hz", rounded(channel.rate_hz(now), 0.1)},
                    {"bytes_per_s", rounded(channel.bytes_per_s(now), 1)},
                    {"messages", tally.messages()},
                    {"gaps", tally.missing()},
                    {"undecodable", tally.undecodable()},
                    {"age_s", rounded(seconds(now - tally.last()), 0.01)}});
  }
  return text_of(list);
}

std::string ChannelHealth::nodes_json(const CellMessages& latest, Utime now) const {
  Json list = Json::array();
  for (const auto& [name, beat] : latest.beats) {
    Json node = {{"node", name}, {"age_s", rounded(seconds(now - beat), 1e-3)}};
    if (const auto found = latest.nodes.find(name); found != latest.nodes.end()) {
      const node_status_t& status = found->second;
      node["state"] = status.state;
      node["reason"] = status.reason;
      node["version"] = status.version;
      node["received"] = status.received;
      node["published"] = status.published;
      node["undecodable"] = status.undecodable;
      node["overflowed"] = status.overflowed;
      node["superseded"] = status.superseded;
      node["counters"] = Json::array();
      for (const counter_t& counter : status.counters) {
        node["counters"].push_back(
            {{"name", counter.name}, {"value", rounded(counter.value, 1e-6)}});
      }
    }
    std::int64_t gaps = 0;
    for (const auto& [key, share] : shares_) {
      if (key.first == name) gaps += share.counter.missing();
    }
    node["rate_hz"] = nullptr;
    node["latency_s"] = nullptr;
    for (const Writer& writer : writers) {
      if (writer.node != name) continue;
      if (const auto found = spy_.channels().find(writer.channel); found != spy_.channels().end()) {
        gaps += found->second.tally.missing();
      }
      if (!node["rate_hz"].is_null()) continue;
      node["channel"] = writer.channel;
      node["rate_hz"] = rounded(rate_of(writer.channel, now), 0.1);
      if (const auto found = latencies_.find(writer.channel); found != latencies_.end()) {
        node["latency_s"] = rounded(found->second, 1e-4);
      }
    }
    node["gaps"] = gaps;
    list.push_back(std::move(node));
  }
  return text_of(list);
}

}  // namespace berth::console
