// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <berth/pose_estimate_t.hpp>
#include <cinttypes>
#include <cstdio>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "common/core/pose.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_reader.h"

namespace berth::commands {
namespace {

struct ChannelFigures {
  std::int64_t messages = 0;
  std::size_t bytes = 0;
};

int info(const std::filesystem::path& log) {
  logs::LogReader reader(log);
  std::map<std::string, ChannelFigures> channels;
  logs::LogEvent event;
  Utime first = 0;
  Utime last = 0;
  while (reader.next(event)) {
    if (first == 0) first = event.utime;
    last = event.utime;
    ChannelFigures& figures = channels[std::string(event.channel)];
    ++figures.messages;
    figures.bytes += event.data.size();
  }
  const double duration = seconds(last - first);
  std::printf("%" PRId64 " messages in %.1f s, %.1f MB; %zu damaged bytes, %" PRId64
              " missing event numbers\n",
              reader.events(), duration, static_cast<double>(reader.size()) * 1e-6,
              reader.damaged_bytes(), reader.missing_events());
  std::printf("%-24s %10s %9s %12s\n", "channel", "messages", "Hz", "bytes each");
  for (const auto& [name, figures] : channels) {
    std::printf("%-24s %10" PRId64 " %9.2f %12.0f\n", name.c_str(), figures.messages,
                duration > 0 ? static_cast<double>(figures.messages) / duration : 0,
                static_cast<double>(figures.bytes) / static_cast<double>(figures.messages));
  }
  return reader.damaged_bytes() > 0 ? exit_code::failed : exit_code::passed;
}

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
    if (event.channel != channels::pose_estimate) continue;
    if (const auto message = logs::decode<pose_estimate_t>(event.data)) {
      std::printf("%s\n", json_of(*message).dump().c_str());
    }
  }
  return exit_code::passed;
}

}  // namespace

void add_log(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("log", "Look into a log");
  command->require_subcommand(1);
  auto file = std::make_shared<std::filesystem::path>();
  auto* info_command = command->add_subcommand(
      "info", "Channels, rates, sizes, gaps and damage; exit code 1 if damaged");
  info_command->add_option("log", *file, "Log file")->required();
  info_command->callback([file, &exit_code] { exit_code = info(*file); });
  auto* estimates_command =
      command->add_subcommand("estimates", "Every estimate as a line of JSON, with all its digits");
  estimates_command->add_option("log", *file, "Log file")->required();
  estimates_command->callback([file, &exit_code] { exit_code = estimates(*file); });
}

}  // namespace berth::commands
