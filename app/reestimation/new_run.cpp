// SPDX-License-Identifier: BSD-3-Clause
#include "app/reestimation/new_run.h"

#include <yaml-cpp/yaml.h>

#include <berth/run_info_t.hpp>
#include <cstdio>

#include "common/core/error.h"
#include "common/core/file.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_reader.h"

namespace berth {
namespace {

namespace fs = std::filesystem;

void write_with_directory(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  write_file(path, text);
}

run_info_t run_info_of(const fs::path& log) {
  logs::LogReader reader(log);
  logs::LogEvent event;
  while (reader.next(event)) {
    if (event.channel != channels::run_info) continue;
    if (const auto info = logs::decode<run_info_t>(event.data)) return *info;
  }
  throw InputError(log.string() + ": holds no RUN_INFO, and its run directory is not there: " +
                   "nobody knows the target and the configuration");
}

std::string run_yaml(const run_info_t& info) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  out << YAML::Key << "name" << YAML::Value << info.run;
  out << YAML::Key << "host" << YAML::Value
      << (info.host == run_info_t::TWIN   ? "twin"
          : info.host == run_info_t::CELL ? "cell"
                                          : "simulated-cell");
  out << YAML::Key << "lcm_url" << YAML::Value << YAML::DoubleQuoted << "";
  out << YAML::Key << "joins" << YAML::Value << false;
  out << YAML::Key << "session" << YAML::Value << info.session;
  out << YAML::Key << "seed" << YAML::Value << info.seed;
  out << YAML::Key << "layout" << YAML::Value << info.layout;
  out << YAML::Key << "target" << YAML::Value << info.target;
  char length[40];  // with all its digits, so that the target is the same to the bit
  std::snprintf(length, sizeof length, "%.17g m", info.target_length_m);
  out << YAML::Key << "target_length" << YAML::Value << length;
  out << YAML::Key << "parameters" << YAML::Value << YAML::BeginMap << YAML::EndMap;
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

void restore_from_log(const fs::path& log, const fs::path& directory) {
  const run_info_t info = run_info_of(log);
  write_with_directory(directory / "run.yaml", run_yaml(info));
  for (const attachment_t& attachment : info.attachments) {
    const fs::path name = fs::path(attachment.name).lexically_normal();
    if (attachment.content.empty() || name.is_absolute() || *name.begin() == "..") continue;
    const bool procedure = name == "procedure.yaml";
    write_with_directory(procedure ? directory / name : directory / "config" / name,
                         attachment.content);
  }
}

void copy_run(const fs::path& from, const fs::path& directory) {
  for (const char* part : {"run.yaml", "procedure.yaml", "config", "target"}) {
    if (fs::exists(from / part)) {
      fs::copy(from / part, directory / part, fs::copy_options::recursive);
    }
  }
}

void take_configuration(const fs::path& config, const fs::path& own) {
  constexpr auto over = fs::copy_options::overwrite_existing;
  if (!fs::is_directory(config)) {
    if (!fs::exists(config)) throw InputError("--config " + config.string() + ": no such file");
    fs::copy_file(config, own / "estimator.yaml", over);
    return;
  }
  if (!fs::exists(config / "estimator.yaml")) {
    throw InputError("--config " + config.string() + ": has no estimator.yaml");
  }
  fs::copy_file(config / "estimator.yaml", own / "estimator.yaml", over);
  if (fs::is_directory(config / "lidars")) {
    fs::copy(config / "lidars", own / "lidars", over | fs::copy_options::recursive);
  }
}

/// Puts one value into estimator.yaml; whether the key is known is told when the file is read.
void set_value(const YAML::Node& root, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw InputError("--set " + assignment + ": expected KEY=VALUE, e.g. tracking.method=icp");
  }
  std::string key = assignment.substr(0, equals);
  YAML::Node node = root;
  for (auto dot = key.find('.'); dot != std::string::npos; dot = key.find('.')) {
    YAML::Node inner = node[key.substr(0, dot)];
    if (inner.IsDefined() && !inner.IsMap()) {
      throw InputError("--set " + assignment + ": '" + key.substr(0, dot) + "' has no keys");
    }
    node.reset(inner);
    key = key.substr(dot + 1);
  }
  try {
    node[key] = YAML::Load(assignment.substr(equals + 1));
  } catch (const YAML::Exception& error) {
    throw InputError("--set " + assignment + ": " + error.msg);
  }
}

void set_values(const std::vector<std::string>& assignments, const fs::path& file) {
  if (assignments.empty()) return;
  YAML::Node root = YAML::Load(read_file(file));
  for (const std::string& assignment : assignments) set_value(root, assignment);
  YAML::Emitter out;
  out << root;
  write_with_directory(file, std::string(out.c_str()) + "\n");
}

}  // namespace

fs::path log_of_run(const fs::path& run_or_log) {
  const fs::path log = fs::is_directory(run_or_log) ? run_or_log / "run.lcm" : run_or_log;
  if (!fs::exists(log)) throw InputError(log.string() + ": no such file");
  return log;
}

RunFiles make_new_run(const fs::path& run_or_log, const EstimatorChanges& changes,
                      const fs::path& directory) {
  const fs::path log = log_of_run(run_or_log);
  fs::create_directories(directory);
  const fs::path home = fs::absolute(log).parent_path();
  if (fs::exists(home / "run.yaml") && fs::is_directory(home / "config")) {
    copy_run(home, directory);
  } else {
    restore_from_log(log, directory);
  }
  const fs::path config = directory / "config";
  fs::create_directories(config);
  if (!changes.config.empty()) take_configuration(changes.config, config);
  if (!fs::exists(config / "estimator.yaml")) {
    throw InputError(log.string() + ": RUN_INFO does not hold estimator.yaml: give --config");
  }
  set_values(changes.set, config / "estimator.yaml");
  return RunFiles::open(directory);
}

}  // namespace berth
