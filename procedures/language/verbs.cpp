// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/verbs.h"

#include <algorithm>
#include <stdexcept>

namespace berth::procedures {
namespace {

std::vector<VerbInfo> all_families() {
  std::vector<VerbInfo> all;
  for (const auto family : {cell_verbs, motion_verbs, scan_verbs, operator_verbs}) {
    for (VerbInfo& verb : family()) all.push_back(std::move(verb));
  }
  return all;
}

}  // namespace

void expect_nothing(Config& step, const std::string& verb) {
  if (!step.raw(verb).is_nothing()) throw step.error(verb, "expected nothing behind it");
}

const std::vector<VerbInfo>& verbs() {
  static const std::vector<VerbInfo> all = all_families();
  return all;
}

const VerbInfo* verb_named(const std::string& name) {
  const auto& all = verbs();
  const auto found =
      std::find_if(all.begin(), all.end(), [&name](const VerbInfo& v) { return v.name == name; });
  return found == all.end() ? nullptr : &*found;
}

Read read_verb(const VerbInfo& verb, Config& step) {
  const bool is_map = step.raw(verb.name).is_map();
  if (verb.from_map != nullptr && (is_map || verb.from_value == nullptr)) {
    Config map = step.section(verb.name);
    Read read = verb.from_map(map);
    finish_keys(map, verb.keys, verb.name);
    return read;
  }
  return verb.from_value(step);
}

void finish_keys(const Config& map, const std::vector<KeyInfo>& keys, const std::string& where) {
  map.finish();
  for (const std::string& key : map.keys_read()) {
    const auto same = [&key](const KeyInfo& info) { return info.key == key; };
    if (std::any_of(keys.begin(), keys.end(), same)) continue;
    throw std::logic_error("the table of '" + where + "' does not have its key '" + key + "'");
  }
}

}  // namespace berth::procedures
