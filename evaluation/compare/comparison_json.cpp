// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "common/core/valid_text.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/words.h"

namespace berth::evaluation {
namespace {

using nlohmann::ordered_json;

ordered_json json_of_criteria(const Comparison& comparison) {
  ordered_json list = ordered_json::array();
  for (std::size_t i = 0; i < comparison.criteria.size(); ++i) {
    const criterion_result_t& c = comparison.criteria[i];
    list.push_back({{"name", c.name},
                    {"measurement", c.measurement},
                    {"phase", c.phase},
                    {"unit", c.unit},
                    {"value", c.value},
                    {"uncertainty", c.uncertainty},
                    {"min", c.lower_limit},
                    {"max", c.upper_limit},
                    {"margin", margin(c)},
                    {"samples", c.samples},
                    {"result", words::of_criterion(c.result)},
                    {"reason", c.reason}});
    const std::string& claim = comparison.claims[i];
    if (!claim.empty()) list.back()["claim"] = claim;
  }
  return list;
}

ordered_json json_of_phases(const std::vector<PhaseTable>& phases) {
  ordered_json list = ordered_json::array();
  for (const PhaseTable& phase : phases) {
    ordered_json rows = ordered_json::object();
    for (const SeriesRow& row : phase.rows) {
      rows[row.measurement->name] = {{"unit", row.measurement->unit},
                                     {"samples", row.samples},
                                     {"mean", row.mean},
                                     {"rms", row.rms},
                                     {"p50", row.p50},
                                     {"p90", row.p90},
                                     {"p95", row.p95},
                                     {"p99", row.p99},
                                     {"peak", row.peak},
                                     {"uncertainty", row.uncertainty}};
    }
    ordered_json numbers = ordered_json::object();
    for (const NumberRow& row : phase.numbers) {
      numbers[row.measurement->name] = {{"unit", row.measurement->unit},
                                        {"samples", row.samples},
                                        {"value", row.value},
                                        {"uncertainty", row.uncertainty},
                                        {"reason", row.reason}};
    }
    list.push_back({{"phase", phase.phase},
                    {"duration_s", phase.duration_s},
                    {"estimates", phase.estimates},
                    {"update_rate_hz", phase.update_rate_hz},
                    {"tracking_share", phase.tracking_share},
                    {"measurements", rows},
                    {"numbers", numbers}});
  }
  return list;
}

ordered_json json_of_run(const run_info_t& info) {
  ordered_json files = ordered_json::object();
  for (const attachment_t& a : info.attachments) files[a.name] = a.sha256;
  return {{"run", info.run},
          {"host", text_of_host(info.host)},
          {"version", info.version},
          {"seed", info.seed},
          {"session", info.session},
          {"procedure", info.procedure},
          {"layout", info.layout},
          {"target", info.target},
          {"target_length_m", info.target_length_m},
          {"target_hash", info.target_hash},
          {"configuration_hash", info.configuration_hash},
          {"files", files}};
}

ordered_json json_of_steps(const std::vector<procedure_step_t>& steps) {
  ordered_json list = ordered_json::array();
  for (const procedure_step_t& s : steps) {
    list.push_back({{"name", s.name},
                    {"phase", s.phase},
                    {"state", words::of_step_state(s.state)},
                    {"attempts", s.attempts},
                    {"depth", s.depth},
                    {"detail", s.detail},
                    {"utime_start", s.utime_start},
                    {"utime_end", s.utime_end}});
  }
  return list;
}

ordered_json json_of_truth(const Comparison& comparison) {
  ordered_json bases = ordered_json::array();
  for (const TruthBasis& b : comparison.truth_bases) {
    bases.push_back({{"basis", b.basis}, {"calibration_hash", b.calibration_hash}});
  }
  return {{"rests_on", bases},
          {"position_sigma_m", comparison.truth_position_sigma},
          {"attitude_sigma_rad", comparison.truth_attitude_sigma}};
}

const char* kind_of(Latency::Kind kind) {
  constexpr const char* names[] = {"delay", "clock", "round trip"};
  return names[static_cast<int>(kind)];
}

ordered_json json_of_latencies(const std::vector<Latency>& latencies) {
  ordered_json list = ordered_json::array();
  for (const Latency& l : latencies) {
    list.push_back({{"name", l.name},
                    {"kind", kind_of(l.kind)},
                    {"value_s", l.value},
                    {"low_s", l.low},
                    {"high_s", l.high},
                    {"samples", l.samples},
                    {"remark", l.remark}});
    if (l.kind != Latency::Kind::delay) continue;
    list.back()["sigma_information_s"] = l.sigma_information;
    list.back()["sigma_bootstrap_s"] = l.sigma_bootstrap;
    list.back()["sigma_truth_offset_s"] = l.sigma_offset;
  }
  return list;
}

}  // namespace

std::string json_of(const Comparison& comparison) {
  const LogSummary& log = comparison.summary;
  ordered_json json = {
      {"schema", "berth-results-1"},
      {"log",
       {{"file", comparison.log},
        {"events", log.events},
        {"missing_events", log.missing_events},
        {"damaged_bytes", log.damaged_bytes},
        {"undecodable", log.undecodable}}},
      {"outcome", words::of_outcome(comparison.outcome)},
      {"exit_code", exit_code_of_outcome(comparison.outcome)},
      {"reason", comparison.reason},
      {"recorded_outcome", words::of_outcome(comparison.recorded_outcome)},
      {"agrees_with_recorded", comparison.agrees},
      {"duration_s", comparison.duration_s},
      {"steps", json_of_steps(comparison.steps)},
      {"criteria", json_of_criteria(comparison)},
      {"phases", json_of_phases(comparison.phases)},
      {"truth", json_of_truth(comparison)},
      {"latencies", json_of_latencies(comparison.latencies)},
      {"remarks", comparison.remarks},
  };
  if (!comparison.source.empty()) json["source"] = comparison.source;
  if (comparison.info) json["run"] = json_of_run(*comparison.info);
  return json_text(json, 2) + "\n";
}

}  // namespace berth::evaluation
