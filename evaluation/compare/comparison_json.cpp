// SPDX-License-Identifier: BSD-3-Clause
#include <nlohmann/json.hpp>

#include "common/core/valid_text.h"
#include "evaluation/compare/comparison.h"
#include "lcmtypes/words.h"

namespace berth::evaluation {
namespace {

using nlohmann::ordered_json;

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

ordered_json json_of_truth(const Comparison& comparison) {
  ordered_json bases = ordered_json::array();
  for (const TruthBasis& b : comparison.truth_bases) {
    bases.push_back({{"basis", b.basis}, {"calibration_hash", b.calibration_hash}});
  }
  return {{"rests_on", bases},
          {"position_sigma_m", comparison.truth_position_sigma},
          {"attitude_sigma_rad", comparison.truth_attitude_sigma}};
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
      {"steps", json_table(steps_table(comparison.steps))},
      {"criteria", json_table(criteria_table(comparison.criteria, comparison.claims))},
      {"phases", json_of_phases(comparison.phases)},
      {"truth", json_of_truth(comparison)},
      {"latencies", json_table(latency_table(comparison.latencies))},
      {"remarks", comparison.remarks},
  };
  if (!comparison.source.empty()) json["source"] = comparison.source;
  if (comparison.info) json["run"] = json_of_run(*comparison.info);
  return json_text(json, 2) + "\n";
}

}  // namespace berth::evaluation
