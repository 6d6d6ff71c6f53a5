// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/source.h"

#include <filesystem>
#include <functional>

#include "common/core/file.h"
#include "procedures/language/sweep.h"

namespace berth::procedures {

const std::string& Library::text(const std::string& name) {
  const auto known = texts_.find(name);
  if (known != texts_.end()) return known->second;
  const std::string path = file(name);
  return texts_[name] = clean_text(read_file(path), path);
}

Source make_source(const std::string& text, const std::string& file, const std::string& name,
                   const Overrides& overrides) {
  const Written written = read_written(text, file);
  Filled filled = apply_parameters(written, file, overrides, swept_names(written.tree));
  return {std::move(filled.text), filled.tree, file, name, written.as_run, {}};
}

namespace {

/// Name in the library: the file's path relative to the procedure that runs, and a suffix that
/// distinguishes two uses of it.
std::string name_of(const YamlNode& rule, const std::string& key, const Source& source) {
  const auto text = [&](const char* option) { return rule.at(option).text(); };
  const auto folder = std::filesystem::path(source.name).parent_path();
  const std::string from = text(key == "file" ? "name" : "run");
  std::string name = (folder / from).lexically_normal().generic_string();
  if (key == "file") return name;
  for (const char* option : {"phase", "of", "spacing"}) name += "; " + text(option);
  return name;
}

using Visit = std::function<void(YamlNode rule, const std::string& name)>;

/// Every rule of the step that reads from elsewhere.
void visit_rules(const YamlNode& node, const Source& source, const Visit& visit) {
  for (const auto& [key, value] : node.entries()) {
    if (key.text() != "trajectory" && key.text() != "target_motion") {
      visit_rules(value, source, visit);
      continue;
    }
    for (const char* rule : {"file", "log"}) {
      const YamlNode found = value.at(rule);
      if (found.is_map()) visit(found, name_of(found, rule, source));
    }
  }
}

}  // namespace

void give_attached(const Config& step, const Source& source, const Library& library) {
  visit_rules(step.node(), source, [&](YamlNode rule, const std::string& name) {
    const auto known = library.texts().find(name);
    if (known != library.texts().end()) rule.put(attached_key, known->second);
  });
}

void keep_attached(const Config& step, const Source& source, Library& library) {
  visit_rules(step.node(), source, [&](const YamlNode& rule, const std::string& name) {
    if (rule.has(attached_key)) library.attach(name, rule.at(attached_key).text());
  });
}

}  // namespace berth::procedures
