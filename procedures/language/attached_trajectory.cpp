// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/attached_trajectory.h"

#include <filesystem>
#include <functional>

namespace berth::procedures {
namespace {

/// In the library: the file, seen from the procedure that runs, and what else tells two apart.
std::string name_of(const YAML::Node& rule, const std::string& key, const Source& source) {
  const auto text = [&](const char* option) {
    return rule[option] && rule[option].IsScalar() ? rule[option].Scalar() : std::string();
  };
  const auto folder = std::filesystem::path(source.name).parent_path();
  const std::string from = text(key == "file" ? "name" : "run");
  std::string name = (folder / from).lexically_normal().generic_string();
  if (key == "file") return name;
  for (const char* option : {"phase", "of", "spacing"}) name += "; " + text(option);
  return name;
}

using Visit = std::function<void(YAML::Node rule, const std::string& name)>;

/// Every rule of the step that reads from elsewhere.
void visit_rules(const YAML::Node& node, const Source& source, const Visit& visit) {
  if (!node.IsMap()) return;
  for (const auto& entry : node) {
    const std::string key = entry.first.Scalar();
    if (!entry.second.IsMap()) continue;
    if (key != "trajectory" && key != "target_motion") {
      visit_rules(entry.second, source, visit);
      continue;
    }
    for (const char* rule : {"file", "log"}) {
      const YAML::Node found = entry.second[rule];
      if (found && found.IsMap()) visit(found, name_of(found, rule, source));
    }
  }
}

}  // namespace

void give_attached(const Config& step, const Source& source, const Library& library) {
  visit_rules(step.node(), source, [&](YAML::Node rule, const std::string& name) {
    const auto known = library.texts().find(name);
    if (known != library.texts().end()) rule[attached_key] = known->second;
  });
}

void keep_attached(const Config& step, const Source& source, Library& library) {
  visit_rules(step.node(), source, [&](const YAML::Node& rule, const std::string& name) {
    if (rule[attached_key]) library.attach(name, rule[attached_key].Scalar());
  });
}

}  // namespace berth::procedures
