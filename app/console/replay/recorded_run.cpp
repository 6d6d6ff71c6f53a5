// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/replay/recorded_run.h"

#include <algorithm>
#include <berth/event_t.hpp>
#include <berth/scan_request_t.hpp>

#include "app/console/view/section.h"
#include "common/core/error.h"
#include "drivers/devices.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"

namespace berth::console {
namespace {

constexpr std::size_t events_shown = 300;
constexpr std::size_t marks_shown = 500;
constexpr std::size_t max_scan = 2000;  // packets

/// The last of these places that is before a place, and all earlier ones.
auto before(const std::vector<std::uint32_t>& places, std::size_t place) {
  return std::lower_bound(places.begin(), places.end(), place);
}

}  // namespace

RecordedRun::RecordedRun(const std::filesystem::path& directory,
                         const std::function<void(double)>& progress)
    : files_(RunFiles::open(directory)),
      cell_(load_cell(files_.setup)),
      lidar_(load_lidar_profile(files_.setup, load_devices(files_.setup.config).lidar.model)),
      index_(files_.log(), progress) {
  if (index_.empty()) throw InputError(files_.log().string() + ": holds no message");
  sort_by_channel();
  find_procedures();
  find_begin();
}

void RecordedRun::sort_by_channel() {
  for (std::size_t i = 0; i < index_.size(); ++i) {
    const std::string_view channel = index_.at(i).channel;
    auto found = places_.find(channel);
    if (found == places_.end()) found = places_.emplace(channel, Places()).first;
    found->second.push_back(static_cast<std::uint32_t>(i));
  }
}

void RecordedRun::find_procedures() {
  const Places& states = places_of(channels::procedure_state);
  const auto at = [&](std::size_t i) {
    return logs::decode<procedure_state_t>(index_.at(states[i]).data);
  };
  for (std::size_t end = states.size(); end > 0;) {
    const auto last = at(end - 1);
    if (!last) {
      --end;
      continue;
    }
    procedures_.insert(procedures_.begin(), *last);
    std::size_t first = 0;  // of this procedure's states: they are many
    for (std::size_t known = end - 1; first < known;) {
      const std::size_t middle = (first + known) / 2;
      const auto state = at(middle);
      const bool same = state && state->utime_start == last->utime_start;
      (same ? known : first) = same ? middle : middle + 1;
    }
    end = first;
  }
}

void RecordedRun::find_begin() {
  begin_ = index_.first();
  for (const procedure_state_t& procedure : procedures_) {
    for (const procedure_step_t& step : procedure.steps) {
      if (step.utime_start == 0) continue;
      begin_ = step.utime_start;
      return;
    }
  }
}

const RecordedRun::Places& RecordedRun::places_of(const std::string& channel) const {
  static const Places none;
  const auto found = places_.find(channel);
  return found == places_.end() ? none : found->second;
}

CellView::Verdicts RecordedRun::verdicts() const {
  CellView::Verdicts verdicts;
  for (const procedure_state_t& procedure : procedures_) {
    verdicts[procedure.utime_start] = procedure.criteria;
  }
  return verdicts;
}

Json RecordedRun::marks() const {
  Json marks = Json::array();
  const auto time = [this](Utime utime) { return rounded(seconds(utime - index_.first()), 1e-3); };
  for (const procedure_state_t& procedure : procedures_) {
    for (const procedure_step_t& step : procedure.steps) {
      if (step.utime_start == 0) continue;
      const Utime end = step.utime_end != 0 ? step.utime_end : procedure.utime;
      marks.push_back({{"kind", "step"},
                       {"time_s", time(step.utime_start)},
                       {"end_s", time(end)},
                       {"text", step.name},
                       {"state", step.state}});
    }
  }
  // Of very many the first: what went wrong first is the cause.
  for (const std::uint32_t place : places_of(channels::event)) {
    if (marks.size() >= marks_shown) break;
    const auto event = logs::decode<event_t>(index_.at(place).data);
    if (!event) continue;
    marks.push_back({{"kind", "event"},
                     {"time_s", time(event->utime)},
                     {"text", event->node + ": " + event->text},
                     {"severity", event->severity}});
  }
  return marks;
}

void RecordedRun::samples(const Samples::Ready& ready) const {
  Samples samples(ready);
  Places all;
  for (const char* channel :
       {channels::pose_estimate, channels::ground_truth, channels::estimator_diagnostics}) {
    const Places& places = places_of(channel);
    all.insert(all.end(), places.begin(), places.end());
  }
  std::sort(all.begin(), all.end());
  for (const std::uint32_t place : all) {
    const logs::LogEvent event = index_.at(place);
    samples.take(event);
    samples.advance(event.utime);
  }
  samples.finish();
}

RecordedRun::Places RecordedRun::last_scan(std::size_t place) const {
  Places scan;
  const Places& packets = places_of(channels::scan_data);
  std::optional<std::int64_t> id;
  for (auto at = before(packets, place); at != packets.begin() && scan.size() < max_scan;) {
    const auto packet = logs::decode<ScanPacket>(index_.at(*--at).data);
    if (!packet) continue;
    if (!id) id = packet->scan_id;
    if (packet->scan_id != *id) break;
    scan.push_back(*at);
  }
  const Places& requests = places_of(channels::scan_request);
  for (auto at = before(requests, place); id && at != requests.begin();) {
    const auto request = logs::decode<scan_request_t>(index_.at(*--at).data);
    if (!request || request->scan_id > *id) continue;
    if (request->scan_id == *id) scan.push_back(*at);
    if (request->action == scan_request_t::SCAN) break;
  }
  return scan;
}

void RecordedRun::build(CellView& view, std::size_t place) const {
  const Utime now = place < index_.size() ? index_.time(place) : index_.last();
  const std::size_t run_up_place = std::min(index_.not_before(now - run_up), place);
  Places taken = last_scan(place);
  std::erase_if(taken, [&](std::uint32_t p) { return p >= run_up_place; });
  for (const auto& [channel, places] : places_) {
    const auto end = before(places, run_up_place);
    const auto count = static_cast<std::size_t>(end - places.begin());
    const std::size_t kept = channel == channels::event ? events_shown : 1;
    taken.insert(taken.end(), end - static_cast<std::ptrdiff_t>(std::min(count, kept)), end);
  }
  // What run it is, is known before its message comes.
  const Places& infos = places_of(channels::run_info);
  if (!infos.empty() && infos.front() >= run_up_place) taken.push_back(infos.front());
  std::sort(taken.begin(), taken.end());
  taken.erase(std::unique(taken.begin(), taken.end()), taken.end());
  view.reset();
  for (const std::uint32_t p : taken) view.take(index_.at(p));
  for (std::size_t p = run_up_place; p < place; ++p) view.take(index_.at(p));
}

}  // namespace berth::console
