// SPDX-License-Identifier: BSD-3-Clause
#include "app/batch/reestimation/new_run.h"

#include <algorithm>
#include <array>
#include <berth/run_info_t.hpp>
#include <cstdio>
#include <string>
#include <string_view>

#include "app/runs/run_list.h"
#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "common/core/renamed_keys.h"
#include "common/core/shared_files.h"
#include "common/core/yaml.h"
#include "common/core/yaml_text.h"
#include "common/targets/target.h"
#include "evaluation/run/target_surface.h"
#include "lcmtypes/channels.h"
#include "logs/file/log_reader.h"

namespace berth {
namespace {

namespace fs = std::filesystem;

/// A key of estimator.yaml as it was, all that it holds with it.
struct OldKey {
  std::string_view key;
  std::string_view value;    ///< that is no more; empty: the key is no more, whatever its value
  std::string_view present;  ///< instead of the value
};

constexpr std::array old_keys = {
    // Replaced by methods that need no options of theirs.
    OldKey{"acquisition.method", "views", "hypotheses"},
    OldKey{"acquisition.views", "", ""},
    OldKey{"tracking.method", "beam", "likelihood"},
    OldKey{"tracking.beam", "", ""},
    // Beams always have the width that the scanner's file states.
    OldKey{"likelihood.footprint", "", ""},
    // A constant of the filter.
    OldKey{"target_tracker.se3.iterations", "", ""},
};

const OldKey* old_key(const std::string& key, const YamlNode& value) {
  const auto* found = std::find_if(old_keys.begin(), old_keys.end(), [&](const OldKey& old) {
    return old.key == key && (old.value.empty() || old.value == value.text());
  });
  return found == old_keys.end() ? nullptr : found;
}

/// The estimator.yaml of an earlier run, with replacements for removed keys and methods. The same
/// node where it has none of them.
/// @param prefix of the map's keys in the file
YamlNode with_present_keys(const YamlNode& map, const std::string& prefix = "") {
  YamlNode result(YamlNode::Kind::map);
  bool same = true;
  for (const auto& [key, value] : map.entries()) {
    const std::string name = prefix + key.text();
    YamlNode now = value;
    if (const OldKey* old = old_key(name, value)) {
      same = false;
      if (old->value.empty()) continue;
      now = YamlNode(std::string(old->present));
    } else if (value.is_map()) {
      now = with_present_keys(value, name + ".");
      same = same && now.is(value);
    }
    result.add(key, now);
  }
  return same ? map : result;
}

void write_with_directory(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  write_file(path, text);
}

run_info_t run_info_of(const fs::path& log) {
  logs::LogReader reader(log);
  logs::LogEvent event;
  while (reader.next(event)) {
    if (const auto info = logs::decode<run_info_t>(event, channels::run_info)) return *info;
  }
  throw InputError(log.string() + ": holds no RUN_INFO, and its run directory is not there: " +
                   "target and configuration are unknown");
}

std::string run_yaml(const run_info_t& info, const fs::path& directory) {
  YamlNode run(YamlNode::Kind::map);
  run.put("name", info.run);
  run.put("host", info.host == run_info_t::TWIN   ? "twin"
                  : info.host == run_info_t::CELL ? "cell"
                                                  : "simulated-cell");
  run.put("lcm_url", "");
  run.put("joins", "false");
  run.put("session", std::to_string(info.session));
  run.put("seed", std::to_string(info.seed));
  run.put("layout", info.layout);
  run.put("target", evaluation::target_name_of_run(info, directory));
  char length[40];  // with all its digits, so that the target is the same to the bit
  std::snprintf(length, sizeof length, "%.17g m", info.target_length_m);
  run.put("target_length", length);
  run.put("parameters", YamlNode(YamlNode::Kind::map));
  return written(run);
}

void restore_from_log(const fs::path& log, const fs::path& directory) {
  const run_info_t info = run_info_of(log);
  write_with_directory(directory / "run.yaml", run_yaml(info, directory));
  for (const attachment_t& attachment : info.attachments) {
    const fs::path name = fs::path(attachment.name).lexically_normal();
    if (attachment.content.empty() || name.is_absolute() || *name.begin() == "..") continue;
    if (name == target_file) continue;  // with its mesh, which no log holds
    const bool next_to_log = name == "procedure.yaml" || name == evaluation::symmetry_file;
    write_with_directory(next_to_log ? directory / name : directory / "config" / name,
                         attachment.content);
  }
}

void copy_run(const fs::path& from, const fs::path& directory) {
  for (const char* part :
       {"run.yaml", "procedure.yaml", evaluation::symmetry_file, "config", "target"}) {
    if (fs::exists(from / part)) {
      copy_writable(from / part, directory / part);
    }
  }
}

void take_configuration(const fs::path& config, const fs::path& own) {
  if (!fs::is_directory(config)) {
    if (!fs::exists(config)) throw InputError("--config " + config.string() + ": no such file");
    copy_writable(config, own / "estimator.yaml");
    return;
  }
  if (!fs::exists(config / "estimator.yaml")) {
    throw InputError("--config " + config.string() + ": has no estimator.yaml");
  }
  copy_writable(config / "estimator.yaml", own / "estimator.yaml");
  if (fs::is_directory(config / "lidars")) copy_writable(config / "lidars", own / "lidars");
}

/// Puts one value into estimator.yaml; an unknown key is reported when the file is read.
void set_value(YamlNode node, const std::string& assignment) {
  const auto equals = assignment.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw InputError("--set " + assignment + ": expected KEY=VALUE, e.g. tracking.method=icp");
  }
  std::string key = assignment.substr(0, equals);
  for (auto dot = key.find('.'); dot != std::string::npos; dot = key.find('.')) {
    const std::string word = key.substr(0, dot);
    if (!node.has(word)) node.put(word, YamlNode(YamlNode::Kind::map));
    node = node.at(word);
    if (!node.is_map()) throw InputError("--set " + assignment + ": '" + word + "' has no keys");
    key = key.substr(dot + 1);
  }
  node.put(key, read_yaml(assignment.substr(equals + 1), "--set " + assignment));
}

void set_values(const std::vector<std::string>& assignments, const fs::path& file) {
  if (assignments.empty()) return;
  const YamlNode root = Config::load(file).node();
  for (const std::string& assignment : assignments) set_value(root, assignment);
  write_with_directory(file, written(root));
}

/// A run's own files, written by an earlier version.
void replace_old_keys(const fs::path& config) {
  for (const fs::path& file : yaml_files(config)) {
    const std::string recorded = read_file(file);
    const std::string present = with_present_names(recorded, file.string());
    if (present != recorded) write_file(file, present);
  }
  const fs::path file = config / "estimator.yaml";
  if (!fs::exists(file)) return;
  const YamlNode recorded = Config::load(file).node();
  const YamlNode present = with_present_keys(recorded);
  if (!present.is(recorded)) write_with_directory(file, written(present));
}

}  // namespace

RunFiles make_new_run(const fs::path& run_or_log, const EstimatorChanges& changes,
                      const fs::path& directory) {
  const fs::path log = log_of_run(run_or_log.string());
  fs::create_directories(directory);
  const fs::path home = fs::absolute(log).parent_path();
  if (fs::exists(home / "run.yaml") && fs::is_directory(home / "config")) {
    copy_run(home, directory);
  } else {
    restore_from_log(log, directory);
  }
  const fs::path config = directory / "config";
  fs::create_directories(config);
  replace_old_keys(config);
  if (!changes.config.empty()) take_configuration(changes.config, config);
  if (!fs::exists(config / "estimator.yaml")) {
    throw InputError(log.string() + ": RUN_INFO does not hold estimator.yaml: give --config");
  }
  set_values(changes.set, config / "estimator.yaml");
  return RunFiles::open(directory);
}

}  // namespace berth
