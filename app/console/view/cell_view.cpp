// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/cell_view.h"

#include <algorithm>
#include <array>
#include <berth/run_info_t.hpp>
#include <utility>

#include "app/console/view/cell_status.h"
#include "app/console/view/estimate_sections.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"

namespace berth::console {
namespace {

/// Sections that are a message as it is.
struct StateSection {
  const char* channel;
  const char* section;
};
constexpr std::array state_sections = {
    StateSection{channels::facility_state, "facility"},
    StateSection{channels::lidar_state, "lidar"},
    StateSection{channels::estimator_state, "estimator"},
    StateSection{channels::operator_control, "control"},
};

const char* word_of_host(std::int8_t host) {
  constexpr const char* words[] = {"cell", "simulated-cell", "twin"};
  return host >= 0 && host <= run_info_t::TWIN ? words[host] : "unknown";
}

/// Bodies further apart than this are no matter.
constexpr double far_apart_m = 3;

template <class Message>
std::string json_of_encoded(const logs::TypeCatalogue& types, const Message& message) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return json_of_message(types, bytes);
}

}  // namespace

CellView::CellView(const Cell& cell, const LidarProfile& lidar, const logs::TypeCatalogue& types,
                   Sink& sink, const Options& options)
    : cell_(cell),
      types_(types),
      sink_(sink),
      options_(options),
      frames_(cell),
      channel_health_(types),
      samples_([this](const Sample& sample) { on_sample(sample); }),
      start_(options.start),
      nearest_(evaluation::nearest_point_on(cell.target)),
      criteria_(nearest_),
      clearance_(cell, {}),
      fast_{options.fast},
      slow_{options.slow} {
  sink.set("scene", scene_json(cell, lidar, drawn_bodies(cell)));
}

void CellView::reset() {
  latest_ = {};
  frames_ = Frames(cell_);
  scan_ = {};
  channel_health_ = ChannelHealth(types_);
  samples_ = Samples([this](const Sample& sample) { on_sample(sample); });
  criteria_ = Criteria(nearest_);
  criteria_so_far_.clear();
  last_sample_.reset();
  states_.clear();
  changed_.clear();
  session_ = 0;
  start_ = options_.start;
  for (const char* list : {"events", "returns"}) sink_.reset(list);
  if (options_.with_samples) sink_.reset("samples");
}

void CellView::take(const logs::LogEvent& event) {
  latest_.take(event);
  scan_.take(event);
  channel_health_.take(event);
  samples_.take(event);
  if (!options_.verdicts) criteria_.take(event);
  if (event.channel == channels::event) {
    std::string json = json_of_message(types_, event.data);
    if (!json.empty() && logs::decode<event_t>(event.data)) sink_.add("events", std::move(json));
  } else if (event.channel == channels::run_info) {
    publish_run(event.data);
  }
  take_state(event);
}

void CellView::take_state(const logs::LogEvent& event) {
  auto news = changed_.find(event.channel);
  if (news == changed_.end()) news = changed_.emplace(event.channel, true).first;
  news->second = true;
  const auto is = [&event](const auto& s) { return event.channel == s.channel; };
  const bool kept = std::any_of(state_sections.begin(), state_sections.end(), is) ||
                    event.channel == channels::arm_state_replica ||
                    event.channel == channels::arm_state_sensor;
  if (kept) states_[std::string(event.channel)].assign(event.data.begin(), event.data.end());
}

bool CellView::changed(const char* channel) {
  const auto found = changed_.find(std::string_view(channel));
  return found != changed_.end() && std::exchange(found->second, false);
}

void CellView::publish_run(Bytes message) {
  auto info = logs::decode<run_info_t>(message);
  if (!info) return;
  if (info->session != session_) {
    session_ = info->session;
    if (options_.start == 0) start_ = info->utime;
  }
  Json json = {{"run", info->run},
               {"host", word_of_host(info->host)},
               {"procedure", info->procedure},
               {"target", info->target},
               {"target_length_m", rounded(info->target_length_m, 1e-4)},
               {"layout", info->layout},
               {"seed", info->seed},
               {"version", info->version},
               {"session", info->session},
               {"configuration_hash", info->configuration_hash},
               {"utime_start", start_}};
  json.update(options_.more_of_run);
  sink_.set("run", text_of(json));
}

void CellView::on_sample(const Sample& sample) {
  last_sample_ = sample;
  changed_[channels::pose_estimate] = true;
  if (!options_.with_samples) return;
  if (start_ == 0) start_ = sample.estimate.utime;
  sink_.add("samples", sample_json(sample, start_));
}

std::optional<Pose> CellView::estimated_pose(Utime now) const {
  return console::estimated_pose(latest_.estimate, now);
}

void CellView::advance(Utime now) {
  sink_.at(now);
  samples_.advance(now);
  if (fast_.due(now)) publish_fast(now);
  if (criteria_pace_.due(now)) criteria_so_far_ = criteria_.so_far();
  if (states_pace_.due(now)) publish_states(now);
  if (slow_.due(now)) publish_slow(now);
}

void CellView::flush(Utime now) {
  sink_.at(now);
  samples_.advance(now);
  criteria_so_far_ = criteria_.so_far();
  publish_fast(now);
  publish_states(now);
  publish_slow(now);
}

void CellView::publish_fast(Utime now) {
  frames_.take(latest_);
  Json frames = frames_.json(latest_, now);
  if (second_ghost_) frames["ghost2"] = json_of(frames_.sensor() * *second_ghost_);
  sink_.set("frames", text_of(frames));
  if (changed(channels::ground_truth) && latest_.truth) {
    sink_.set("truth", truth_json(*latest_.truth));
  }
  if (changed(channels::pose_estimate) && latest_.estimate) {
    const bool judged = last_sample_ && last_sample_->estimate.seq == latest_.estimate->seq;
    sink_.set("estimate",
              estimate_json(*latest_.estimate, judged ? last_sample_->compared : std::nullopt,
                            judged ? last_sample_->latency : std::nullopt));
  }
  scan_.publish(latest_, sink_);
}

void CellView::publish_states(Utime now) {
  const CellStatus safe = cell_status(latest_, now);
  sink_.set("safe", text_of({{"word", safe.word}, {"why", safe.why}}));
  for (const StateSection& state : state_sections) {
    if (!changed(state.channel)) continue;
    std::string json = json_of_message(types_, states_[state.channel]);
    if (!json.empty()) sink_.set(state.section, std::move(json));
  }
  const bool replica = changed(channels::arm_state_replica);
  const bool sensor = changed(channels::arm_state_sensor);
  if (replica || sensor) {
    const auto arm = [this](const char* channel) {
      const auto found = states_.find(std::string_view(channel));
      const std::string json = found == states_.end() ? "" : json_of_message(types_, found->second);
      return json.empty() ? std::string("null") : json;
    };
    sink_.set("arms", "{\"replica\":" + arm(channels::arm_state_replica) +
                          ",\"sensor\":" + arm(channels::arm_state_sensor) + "}");
  }
  if (changed(channels::testbed_state) && latest_.testbed) sink_.set("testbed", testbed_json());
  if (changed(channels::procedure_state) && latest_.procedure) {
    sink_.set("procedure", procedure_json());
  }
}

std::string CellView::testbed_json() {
  std::string json = json_of_encoded(types_, *latest_.testbed);
  if (json.empty()) return "{}";
  const auto closest =
      clearance_.closest({frames_.replica_joints(), frames_.sensor_joints()}, far_apart_m);
  if (!closest) return json;
  const Json between = {{"clearance_between", {closest->a, closest->b}},
                        {"clearance_points", {json_of(closest->at_a), json_of(closest->at_b)}}};
  json.back() = ',';
  return json + text_of(between).substr(1);
}

/// As it is, but that its criteria fill in before the end.
std::string CellView::procedure_json() {
  procedure_state_t state = *latest_.procedure;
  if (state.criteria.empty()) {
    state.criteria = criteria_so_far_;
    if (options_.verdicts) {
      const auto verdict = options_.verdicts->find(state.utime_start);
      if (verdict != options_.verdicts->end()) state.criteria = as_of(verdict->second, state);
    }
    state.criterion_count = static_cast<std::int32_t>(state.criteria.size());
  }
  const std::string json = json_of_encoded(types_, state);
  return json.empty() ? "{}" : json;
}

void CellView::publish_slow(Utime now) {
  sink_.set("nodes", channel_health_.nodes_json(latest_, now));
  sink_.set("channels", channel_health_.channels_json(now));
}

}  // namespace berth::console
