// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <berth/pose_estimate_t.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/commands/log/verbs.h"
#include "app/exit_code.h"
#include "common/core/valid_text.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_reader.h"

namespace berth::commands::log {
namespace {

/// Every field with all its digits: two estimates print the same only if they are the same.
nlohmann::ordered_json json_of(const pose_estimate_t& m) {
  const auto list = [](const double* values, int n) {
    return std::vector<double>(values, values + n);
  };
  nlohmann::ordered_json json;
  json["utime"] = m.utime;
  json["seq"] = m.seq;
  json["session"] = m.session;
  json["command_seq"] = m.command_seq;
  json["scan_id"] = m.scan_id;
  json["packets"] = {m.first_packet, m.last_packet, m.packets_missing};
  json["utime_returns"] = {m.utime_first_return, m.utime_last_return};
  json["target"] = m.target;
  json["target_hash"] = m.target_hash;
  json["method"] = m.method;
  json["operating_range"] = m.operating_range;
  json["status"] = m.status;
  json["reason"] = m.reason;
  json["position_m"] = list(m.position_m, 3);
  json["q_wxyz"] = list(m.q_wxyz, 4);
  json["covariance"] = list(m.covariance, 36);
  json["linear_velocity_m_s"] = list(m.linear_velocity_m_s, 3);
  json["angular_velocity_rad_s"] = list(m.angular_velocity_rad_s, 3);
  json["velocity_covariance"] = list(m.velocity_covariance, 36);
  json["measured_position_m"] = list(m.measured_position_m, 3);
  json["measured_q_wxyz"] = list(m.measured_q_wxyz, 4);
  json["returns"] = {m.returns_received, m.returns_used, m.misses};
  json["iterations"] = m.iterations;
  json["residual_rms_m"] = m.residual_rms_m;
  json["confidence"] = m.confidence;
  for (const auto& h : m.hypotheses) {
    json["hypotheses"].push_back({{"position_m", list(h.position_m, 3)},
                                  {"q_wxyz", list(h.q_wxyz, 4)},
                                  {"probability", h.probability},
                                  {"log_likelihood", h.log_likelihood}});
  }
  return json;
}

int estimates(const std::filesystem::path& log) {
  logs::LogReader reader(log);
  logs::LogEvent event;
  while (reader.next(event)) {
    if (const auto message = logs::decode<pose_estimate_t>(event, channels::pose_estimate)) {
      std::printf("%s\n", json_text(json_of(*message)).c_str());
    }
  }
  return exit_code::passed;
}

}  // namespace

void add_estimates(CLI::App& log, int& exit_code) {
  auto* command =
      log.add_subcommand("estimates", "Every estimate as a line of JSON, with all its digits");
  auto file = add_log_argument(*command);
  command->callback([file, &exit_code] { exit_code = estimates(log_of_run(*file)); });
}

}  // namespace berth::commands::log
