// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/reported_run.h"

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

namespace {

bool is_shown_phase(const evaluation::Phase& phase) {
  return phase.name != evaluation::whole_run && phase.name != evaluation::teardown_phase;
}

/// Times without a good estimate although the estimator ran: from each estimate that is not OK to
/// the next one.
std::vector<Span> losses(const RunView& view, const std::vector<EstimateDetail>& estimates) {
  std::vector<Span> spans;
  bool tracked = false;
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    const EstimateDetail& e = estimates[i];
    const bool lost = e.status == pose_estimate_t::LOST;
    const bool again = tracked && e.status == pose_estimate_t::ACQUIRING;
    tracked |= e.status == pose_estimate_t::OK;
    if (!lost && !again && e.status != pose_estimate_t::AMBIGUOUS) continue;
    const double from = view.at(e.utime);
    const double to = i + 1 < estimates.size() ? view.at(estimates[i + 1].utime) : view.end_s();
    const Span::Kind kind = lost ? Span::Kind::trouble : Span::Kind::uncertain;
    if (!spans.empty() && spans.back().kind == kind && spans.back().to >= from) {
      spans.back().to = std::max(spans.back().to, to);
      continue;
    }
    spans.push_back({from, to,
                     std::string(lost    ? "lost"
                                 : again ? "acquiring again"
                                         : "ambiguous") +
                         (e.reason.empty() ? "" : ": " + e.reason),
                     kind});
  }
  return spans;
}

}  // namespace

std::string ReportedRun::name() const {
  const auto* info = run.record.info();
  if (info && !info->run.empty()) return info->run;
  return directory.empty() ? log.filename().string() : directory.filename().string();
}

std::vector<ReportedRun> read_reported_runs(const std::filesystem::path& log,
                                            const std::filesystem::path& directory) {
  DetailsCollector collector;
  std::vector<evaluation::ComparedRun> compared = evaluation::compare_runs(
      log, [&collector](const logs::LogEvent& event) { collector.take(event); });
  std::vector<ReportedRun> runs;
  for (evaluation::ComparedRun& one : compared) {
    const auto* state = one.record.state();
    const auto* info = one.record.info();
    RunDetails details = collector.details_of(info ? info->session : state->session);
    if (compared.size() > 1 && state) details.keep(state->utime_start, state->utime);
    runs.push_back({log, directory, std::move(one), std::move(details)});
  }
  return runs;
}

RunView::RunView(const ReportedRun& run)
    : source_(run), measurer_(run.run.record, run.run.nearest) {
  const evaluation::LogSummary& log = run.run.comparison.summary;
  start_ = log.first;
  Utime end = log.last;
  for (const evaluation::Phase& phase : record().phases()) {
    if (phase.name == evaluation::whole_run) {
      start_ = phase.start();
      end = phase.end();
    }
    if (is_shown_phase(phase)) phases_.push_back(phase);
  }
  end_s_ = std::max(1e-3, at(end));
  std::vector<Span> stretches;
  for (const evaluation::Phase& phase : phases_) {
    for (const auto& stretch : phase.stretches) {
      stretches.push_back({at(stretch.start), at(stretch.end), phase.name, Span::Kind::phase});
    }
  }
  std::stable_sort(stretches.begin(), stretches.end(),
                   [](const Span& a, const Span& b) { return a.from < b.from; });
  spans_ = std::move(stretches);
  const auto lost = losses(*this, details().estimates);
  spans_.insert(spans_.end(), lost.begin(), lost.end());
  for (const event_t& event : record().events()) {
    if (event.severity < event_t::WARNING) continue;
    marks_.push_back(
        {at(event.utime), event.node + ": " + event.text, event.severity >= event_t::ERROR});
  }
}

std::string RunView::phase_at(Utime utime) const {
  for (const evaluation::Phase& phase : phases_) {
    if (phase.contains(utime)) return phase.name;
  }
  return {};
}

Chart RunView::chart(const std::string& title, const std::string& unit) const {
  Chart chart;
  chart.title = title;
  chart.unit = unit;
  chart.group = "time";
  chart.x_range = {{0, end_s_}};
  chart.spans = spans_;
  chart.marks = marks_;
  return chart;
}

}  // namespace berth::report
