// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/run_details.h"

#include <algorithm>
#include <berth/estimator_diagnostics_t.hpp>

#include "lcmtypes/channels.h"

namespace berth::report {
namespace {

EstimateDetail detail_of(const pose_estimate_t& m) {
  EstimateDetail detail;
  detail.utime = m.utime;
  detail.scan_id = m.scan_id;
  detail.status = m.status;
  detail.reason = m.reason;
  detail.returns_used = m.returns_used;
  detail.returns_received = m.returns_received;
  detail.misses = m.misses;
  return detail;
}

void take_status(const node_status_t& status, NodeHealth& node) {
  if (!node.changes.empty()) {
    node.max_silence = std::max(node.max_silence, status.utime - node.last.utime);
  }
  if (node.changes.empty() || node.last.state != status.state ||
      node.last.reason != status.reason) {
    node.changes.push_back({status.utime, status.state, status.reason});
  }
  node.last = status;
}

}  // namespace

void RunDetails::keep(Utime from, Utime to) {
  const auto outside = [from, to](const auto& one) { return one.utime < from || one.utime > to; };
  std::erase_if(estimates, outside);
  std::erase_if(work_times, outside);
}

void DetailsCollector::take(const logs::LogEvent& event) {
  if (event.channel == channels::pose_estimate) {
    if (const auto m = logs::decode<pose_estimate_t>(event.data)) {
      sessions_[m->session].estimates.push_back(detail_of(*m));
    }
  } else if (event.channel == channels::estimator_diagnostics) {
    if (const auto m = logs::decode<estimator_diagnostics_t>(event.data)) {
      sessions_[m->session].work_times.push_back(
          {m->utime, 1e-6 * static_cast<double>(m->preprocess_us),
           1e-6 * static_cast<double>(m->acquire_us), 1e-6 * static_cast<double>(m->track_us),
           1e-6 * static_cast<double>(m->plan_us)});
    }
  } else if (event.channel == channels::scan_request) {
    const auto m = logs::decode<scan_request_t>(event.data);
    if (m && m->action == scan_request_t::SCAN) sessions_[m->session].scans[m->scan_id] = *m;
  } else if (event.channel == channels::node_status) {
    if (const auto m = logs::decode<node_status_t>(event.data)) {
      take_status(*m, sessions_[m->session].nodes[m->node]);
    }
  }
}

RunDetails DetailsCollector::details_of(std::int64_t session) const {
  const auto found = sessions_.find(session);
  return found == sessions_.end() ? RunDetails() : found->second;
}

}  // namespace berth::report
