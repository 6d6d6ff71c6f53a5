// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/estimate_sections.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "app/console/view/section.h"
#include "common/core/covariance.h"
#include "evaluation/measure/truth_join.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"

namespace berth::console {
namespace {

double root(double variance) { return std::sqrt(std::max(0.0, variance)); }

Json sigmas_of(const Matrix6d& covariance) {
  Json sigmas = Json::array();
  for (Eigen::Index i = 0; i < 6; ++i) sigmas.push_back(rounded(root(covariance(i, i)), 1e-7));
  return sigmas;
}

/// Of the length of a vector that is distributed so.
double position_sigma(const Matrix6d& c) { return root(c.topLeftCorner<3, 3>().trace()); }
double attitude_sigma(const Matrix6d& c) { return root(c.bottomRightCorner<3, 3>().trace()); }

Json error_json(const evaluation::ComparedEstimate& compared) {
  const Matrix6d& truth = compared.truth.covariance;
  const evaluation::Uncertain position =
      evaluation::length_of(compared.error.head<3>(), truth.topLeftCorner<3, 3>());
  const evaluation::Uncertain attitude =
      evaluation::length_of(compared.error.tail<3>(), truth.bottomRightCorner<3, 3>());
  return {{"position_m", rounded(position.value, 1e-6)},
          {"attitude_rad", rounded(attitude.value, 1e-7)},
          {"position_sigma_m", rounded(position.truth_sigma, 1e-6)},
          {"attitude_sigma_rad", rounded(attitude.truth_sigma, 1e-7)}};
}

Json velocity_json(const Vector3d& velocity) { return json_of(velocity, 1e-6); }

}  // namespace

Ellipsoid ellipsoid_of(const Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(covariance);
  Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
  return {solver.eigenvalues().cwiseMax(0.0).cwiseSqrt(), Quaterniond(axes)};
}

std::string truth_json(const evaluation::TruthSample& truth) {
  return text_of({{"utime", truth.utime},
                  {"pose", json_of(truth.pose)},
                  {"xyzwpr", json_of(xyzwpr_from_pose(truth.pose))},
                  {"linear_velocity_m_s", velocity_json(truth.velocity.linear)},
                  {"angular_velocity_rad_s", velocity_json(truth.velocity.angular)},
                  {"sigma", sigmas_of(truth.covariance)},
                  {"position_sigma_m", rounded(position_sigma(truth.covariance), 1e-6)},
                  {"attitude_sigma_rad", rounded(attitude_sigma(truth.covariance), 1e-7)}});
}

std::string estimate_json(const pose_estimate_t& e,
                          const std::optional<evaluation::ComparedEstimate>& compared,
                          std::optional<Utime> latency) {
  const evaluation::EstimateSample sample = evaluation::sample_of(e);
  Json json = {{"utime", e.utime},
               {"scan_id", e.scan_id},
               {"status", e.status},
               {"reason", e.reason},
               {"method", e.method},
               {"target", e.target},
               {"operating_range", e.operating_range},
               {"returns_received", e.returns_received},
               {"returns_used", e.returns_used},
               {"misses", e.misses},
               {"residual_rms_m", rounded(e.residual_rms_m, 1e-6)},
               {"confidence", rounded(e.confidence, 1e-4)},
               {"pose", json_of(sample.pose)},
               {"xyzwpr", json_of(xyzwpr_from_pose(sample.pose))},
               {"linear_velocity_m_s", velocity_json(sample.velocity.linear)},
               {"angular_velocity_rad_s", velocity_json(sample.velocity.angular)},
               {"sigma", nullptr},
               {"position_sigma_m", nullptr},
               {"attitude_sigma_rad", nullptr},
               {"ellipsoid", nullptr},
               {"hypotheses", Json::array()},
               {"error", compared ? error_json(*compared) : Json()},
               {"latency_s", latency ? rounded(seconds(*latency), 1e-5) : Json()}};
  if (is_covariance(sample.covariance)) {
    const Ellipsoid ellipsoid = ellipsoid_of(sample.covariance.topLeftCorner<3, 3>());
    const Quaterniond& q = ellipsoid.rotation;
    json["sigma"] = sigmas_of(sample.covariance);
    json["position_sigma_m"] = rounded(position_sigma(sample.covariance), 1e-6);
    json["attitude_sigma_rad"] = rounded(attitude_sigma(sample.covariance), 1e-7);
    json["ellipsoid"] = {
        {"radii_m", json_of(ellipsoid.radii, 1e-6)},
        {"q",
         {rounded(q.w(), 1e-6), rounded(q.x(), 1e-6), rounded(q.y(), 1e-6), rounded(q.z(), 1e-6)}}};
  }
  for (const hypothesis_t& h : e.hypotheses) {
    json["hypotheses"].push_back(
        {{"pose", json_of(pose_of(h))}, {"probability", rounded(h.probability, 1e-4)}});
  }
  return text_of(json);
}

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
