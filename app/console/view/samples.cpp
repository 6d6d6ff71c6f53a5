// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/samples.h"

#include <cmath>

#include "app/console/view/json.h"
#include "common/core/covariance.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"

namespace berth::console {
namespace {

constexpr Utime patience = second;
constexpr std::size_t latencies_kept = 100;

Json mm_and_deg(const Vector6d& v, double factor = 1) {
  Json json = Json::array();
  for (Eigen::Index i = 0; i < 6; ++i) {
    json.push_back(rounded(factor * (i < 3 ? 1e3 * v[i] : degrees(v[i])), 1e-4));
  }
  return json;
}

/// Three standard deviations of the length of what is distributed so.
double reach(const Matrix3d& covariance) {
  return 3 * std::sqrt(std::max(0.0, covariance.trace()));
}

}  // namespace

void Samples::take(const logs::LogEvent& event) {
  if (const auto info = logs::decode<run_info_t>(event, channels::run_info)) {
    symmetry_ = evaluation::symmetry_of_run(*info);
  } else if (const auto truth = logs::decode<ground_truth_t>(event, channels::ground_truth)) {
    truth_.add_live(evaluation::sample_of(*truth));
  } else if (const auto diagnostics =
                 logs::decode<estimator_diagnostics_t>(event, channels::estimator_diagnostics)) {
    const auto latency = evaluation::latency_in(*diagnostics);
    if (latency) latencies_[diagnostics->seq] = *latency;
    if (latencies_.size() > latencies_kept) latencies_.erase(latencies_.begin());
  } else if (auto estimate = logs::decode<pose_estimate_t>(event, channels::pose_estimate)) {
    waiting_.push_back({{std::move(*estimate), std::nullopt, std::nullopt}, event.utime});
  }
}

void Samples::complete(Waiting& waiting) const {
  Sample& sample = waiting.sample;
  if (!sample.compared && sample.estimate.status == pose_estimate_t::OK) {
    sample.compared =
        evaluation::compare(evaluation::sample_of(sample.estimate), truth_, symmetry_);
  }
  if (const auto found = latencies_.find(sample.estimate.seq); found != latencies_.end()) {
    sample.latency = found->second;
  }
}

void Samples::publish_first() {
  const Sample sample = std::move(waiting_.front().sample);
  waiting_.pop_front();
  ready_(sample);
}

void Samples::advance(Utime now) {
  while (!waiting_.empty()) {
    Waiting& first = waiting_.front();
    complete(first);
    const bool is_good = first.sample.estimate.status == pose_estimate_t::OK;
    const bool is_complete = first.sample.latency && (first.sample.compared || !is_good);
    if (!is_complete && now - first.received < patience) return;
    publish_first();
  }
}

void Samples::finish() {
  while (!waiting_.empty()) {
    complete(waiting_.front());
    publish_first();
  }
}

std::string sample_json(const Sample& sample, Utime start) {
  const pose_estimate_t& e = sample.estimate;
  Json json = {{"time_s", rounded(seconds(e.utime - start), 1e-4)},
               {"scan_id", e.scan_id},
               {"status", e.status},
               {"latency_s", sample.latency ? rounded(seconds(*sample.latency), 1e-5) : Json()}};
  if (e.status != pose_estimate_t::OK) return text_of(json);
  const evaluation::EstimateSample estimate = evaluation::sample_of(e);
  json["estimate"] = json_of(xyzwpr_from_pose(estimate.pose));
  if (is_covariance(estimate.covariance)) {
    json["sigma3"] = mm_and_deg(estimate.covariance.diagonal().cwiseSqrt(), 3);
    json["position_sigma3_mm"] =
        rounded(1e3 * reach(estimate.covariance.topLeftCorner<3, 3>()), 1e-4);
    json["attitude_sigma3_deg"] =
        rounded(degrees(reach(estimate.covariance.bottomRightCorner<3, 3>())), 1e-4);
  }
  json["truth"] = nullptr;
  if (!sample.compared) return text_of(json);
  const evaluation::ComparedEstimate& c = *sample.compared;
  json["truth"] = json_of(xyzwpr_from_pose(c.truth.pose));
  json["error"] = mm_and_deg(c.error);
  json["truth_sigma3"] = mm_and_deg(c.truth.covariance.diagonal().cwiseMax(0).cwiseSqrt(), 3);
  json["position_mm"] = rounded(1e3 * c.error.head<3>().norm(), 1e-4);
  json["attitude_deg"] = rounded(degrees(c.error.tail<3>().norm()), 1e-4);
  return text_of(json);
}

}  // namespace berth::console
