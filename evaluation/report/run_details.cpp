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
  if (const auto estimate = logs::decode<pose_estimate_t>(event, channels::pose_estimate)) {
    sessions_[estimate->session].estimates.push_back(detail_of(*estimate));
  } else if (const auto m =
                 logs::decode<estimator_diagnostics_t>(event, channels::estimator_diagnostics)) {
    sessions_[m->session].work_times.push_back(
        {m->utime, 1e-6 * static_cast<double>(m->preprocess_us),
         1e-6 * static_cast<double>(m->acquire_us), 1e-6 * static_cast<double>(m->track_us),
         1e-6 * static_cast<double>(m->plan_us)});
  } else if (const auto request = logs::decode<scan_request_t>(event, channels::scan_request)) {
    if (request->action == scan_request_t::SCAN) {
      sessions_[request->session].scans[request->scan_id] = *request;
    }
  } else if (const auto status = logs::decode<node_status_t>(event, channels::node_status)) {
    take_status(*status, sessions_[status->session].nodes[status->node]);
  }
}

RunDetails DetailsCollector::details_of(std::int64_t session) const {
  const auto found = sessions_.find(session);
  return found == sessions_.end() ? RunDetails() : found->second;
}

}  // namespace berth::report
