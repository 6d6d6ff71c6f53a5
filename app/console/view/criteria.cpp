// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/criteria.h"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <memory>

#include "common/core/error.h"
#include "lcmtypes/channels.h"
#include "procedures/language/procedure.h"

namespace berth::console {
namespace {

/// Truth is measured between its samples and over 50 ms to either side.
constexpr Utime truth_period = 40 * millisecond;

/// The same points are needed whenever the criteria are measured.
evaluation::NearestPoint remembering(evaluation::NearestPoint nearest) {
  if (!nearest) return nearest;
  const auto known = std::make_shared<std::map<std::array<double, 3>, Vector3d>>();
  evaluation::NearestPoint remembered = [nearest, known](const Vector3d& point) {
    const auto [place, is_new] = known->try_emplace({point.x(), point.y(), point.z()});
    if (is_new) place->second = nearest(point);
    return place->second;
  };
  remembered.rays = nearest.rays;
  return remembered;
}

std::string procedure_in(const run_info_t& info) {
  for (const attachment_t& attachment : info.attachments) {
    if (attachment.name == "procedure.yaml") return attachment.content;
  }
  return {};
}

}  // namespace

Criteria::Criteria(evaluation::NearestPoint nearest) : nearest_(remembering(std::move(nearest))) {}

void Criteria::begin(const run_info_t& info) {
  session_ = info.session;
  record_ = {};
  record_.add(info);
  criteria_.clear();
  const std::string text = procedure_in(info);
  if (text.empty()) return;
  try {
    criteria_ = procedures::parse_procedure(text, "procedure.yaml").criteria;
    judges_returns_ = std::any_of(criteria_.begin(), criteria_.end(), [](const auto& criterion) {
      return criterion.measurement->of_returns;
    });
  } catch (const InputError&) {
    // A procedure of another version, which this one cannot read: its own verdict is shown in the
    // end.
  }
}

void Criteria::take(const logs::LogEvent& event) {
  const auto add = [&](const auto& message) {
    if (message && message->session == session_) record_.add(*message);
  };
  if (event.channel == channels::run_info) {
    const auto info = logs::decode<run_info_t>(event.data);
    const bool another =
        info && (!record_.info() || record_.info()->run != info->run || session_ != info->session);
    if (another) begin(*info);
  } else if (criteria_.empty()) {
    return;
  } else if (event.channel == channels::ground_truth) {
    const auto truth = logs::decode<ground_truth_t>(event.data);
    if (!truth || truth->session != session_) return;
    const bool needed = truth->utime < last_truth_ || truth->utime - last_truth_ >= truth_period;
    if (!needed) return;
    last_truth_ = truth->utime;
    record_.add(*truth);
  } else if (event.channel == channels::pose_estimate) {
    add(logs::decode<pose_estimate_t>(event.data));
  } else if (event.channel == channels::estimator_diagnostics) {
    add(logs::decode<estimator_diagnostics_t>(event.data));
  } else if (event.channel == channels::testbed_state) {
    add(logs::decode<testbed_state_t>(event.data));
  } else if (event.channel == channels::setpoint_latency) {
    add(logs::decode<setpoint_latency_t>(event.data));
  } else if (event.channel == channels::scan_data && judges_returns_) {
    add(logs::decode<ScanPacket>(event.data));
  } else if (event.channel == channels::procedure_state) {
    add(logs::decode<procedure_state_t>(event.data));
  }
}

std::vector<criterion_result_t> Criteria::so_far() const {
  if (criteria_.empty() || !record_.state()) return {};
  auto results = evaluation::judge(criteria_, evaluation::Measurer(record_, nearest_));
  for (criterion_result_t& result : results) {
    if (!is_over(result.phase, *record_.state())) result.result = criterion_result_t::PENDING;
  }
  return results;
}

bool is_over(const std::string& phase, const procedure_state_t& state) {
  if (state.state == procedure_state_t::FINISHED) return true;
  if (phase == evaluation::whole_run) return false;
  bool is_there = false;
  for (const procedure_step_t& step : state.steps) {
    if (step.phase != phase) continue;
    is_there = true;
    if (step.state == procedure_step_t::PENDING || step.state == procedure_step_t::RUNNING) {
      return false;
    }
  }
  return is_there;
}

std::vector<criterion_result_t> as_of(std::vector<criterion_result_t> results,
                                      const procedure_state_t& state) {
  for (criterion_result_t& result : results) {
    if (is_over(result.phase, state)) continue;
    result.result = criterion_result_t::PENDING;
    result.value = std::numeric_limits<double>::quiet_NaN();
    result.uncertainty = result.value;
    result.samples = 0;
    result.reason.clear();
  }
  return results;
}

}  // namespace berth::console
