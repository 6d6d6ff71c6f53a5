// SPDX-License-Identifier: BSD-3-Clause
#include "app/commands/estimate_report.h"

namespace berth::commands {

namespace {

using Json = nlohmann::ordered_json;
using namespace estimator;

template <class Matrix>
Json rows_of(const Matrix& matrix) {
  Json rows = Json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r) {
    Json row = Json::array();
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) row.push_back(matrix(r, c));
    rows.push_back(std::move(row));
  }
  return rows;
}

Json blank(const std::string& file, const std::string& status, const std::string& reason) {
  Json report;
  report["file"] = file;
  report["status"] = status;
  report["reason"] = reason;
  for (const char* key : {"T_sensor_model", "xyzwpr", "covariance"}) report[key] = nullptr;
  report["hypotheses"] = Json::array();
  for (const char* key : {"equal_poses", "log_likelihood", "counts", "times_ms", "methods"}) {
    report[key] = nullptr;
  }
  report["notes"] = Json::array();
  return report;
}

void put_pose(const PoseCandidate& candidate, Json& report) {
  report["T_sensor_model"] = rows_of(candidate.pose.isometry().matrix());
  report["xyzwpr"] = xyzwpr_from_pose(candidate.pose);
  report["covariance"] = candidate.covariance ? rows_of(*candidate.covariance) : Json();
  report["equal_poses"] = candidate.equal_poses;
  report["log_likelihood"] = candidate.log_likelihood ? Json(*candidate.log_likelihood) : Json();
}

Json counts_of(const clouds::Cloud& cloud, const PreprocessedScan& scan, int used) {
  Json dropped;
  dropped["not_finite"] = cloud.counts.not_finite;
  dropped["at_sensor"] = cloud.counts.at_sensor;
  dropped["later_returns"] = cloud.counts.later_returns;
  dropped["empty_without_direction"] = cloud.counts.undirected;
  dropped["nearer_than_gate"] = scan.nearer;
  dropped["farther_than_gate"] = scan.farther;
  dropped["beyond_any_sensor"] = scan.invalid;
  dropped["repeated"] = scan.repeated;
  Json counts;
  counts["points"] = cloud.counts.points;
  counts["returns"] = scan.points.size();
  counts["misses"] = scan.misses;
  counts["used"] = used;
  counts["dropped"] = dropped;
  return counts;
}

double milliseconds(std::int64_t us) { return 1e-3 * static_cast<double>(us); }

}  // namespace

Json report_of(const std::string& file, const clouds::Cloud& cloud, const PreprocessedScan& scan,
               const SingleScan& method, const SingleScanResult& result, std::int64_t read_us) {
  Json report = blank(file, name_of(result.status), result.reason);
  int used = 0;
  if (result.status != SingleScanResult::Status::lost) {
    put_pose(result.candidates.front(), report);
    used = result.candidates.front().used;
  }
  for (const PoseCandidate& candidate : result.candidates) {
    Json hypothesis;
    hypothesis["probability"] = candidate.probability;
    put_pose(candidate, hypothesis);
    report["hypotheses"].push_back(std::move(hypothesis));
  }
  report["counts"] = counts_of(cloud, scan, used);
  report["times_ms"] = {{"read", milliseconds(read_us)},
                        {"acquire", milliseconds(result.acquire_us)},
                        {"refine", milliseconds(result.refine_us)}};
  report["methods"] = {
      {"acquisition", result.acquired ? Json(method.acquisition_method()) : Json()},
      {"tracking", method.tracking_method()}};
  for (const auto* notes : {&cloud.notes, &result.notes}) {
    for (const std::string& note : *notes) report["notes"].push_back(note);
  }
  return report;
}

Json error_report(const std::string& file, const std::string& reason) {
  return blank(file, "error", reason);
}

}  // namespace berth::commands
