// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/targets/write_measured.h"

#include <algorithm>

#include "common/core/error.h"
#include "common/core/text.h"
#include "common/core/yaml_text.h"

namespace berth::targets {
namespace {

/// Text that takes the place of another, or, where `begin` is `end`, stands before it.
struct Edit {
  std::size_t begin;
  std::size_t end;
  std::string text;
};

void put(const std::string& yaml, const YamlNode& map, const std::string& key,
         const std::string& value, std::vector<Edit>& edits) {
  if (map.has(key)) {
    const auto span = span_of(yaml, map.at(key));
    if (!span)
      throw InputError("line " + std::to_string(map.line()) + ": '" + key + "' is no text");
    return edits.push_back({span->begin, span->end, value});
  }
  if (map.size() == 0) {
    throw InputError("line " + std::to_string(map.line()) + ": found nothing, expected keys");
  }
  // Before the first key, which stands in braces, or on a line of its own.
  const std::size_t at = map.entries().front().first.offset();
  const std::size_t before = yaml.find_last_not_of(' ', at - 1);
  if (at > 0 && before != std::string::npos && yaml[before] == '{') {
    edits.push_back({at, at, key + ": " + value + ", "});
  } else {
    const std::size_t line = before == std::string::npos ? 0 : yaml.rfind('\n', at) + 1;
    edits.push_back({line, line, std::string(at - line, ' ') + key + ": " + value + "\n"});
  }
}

}  // namespace

std::string with_measured(const std::string& yaml, const std::string& name,
                          const std::vector<PartMeasurement>& parts) {
  std::string text = clean_text(yaml, name);
  const YamlNode root = read_yaml(text, name);
  std::vector<Edit> edits;
  for (const PartMeasurement& part : parts) {
    const YamlNode map =
        part.part == "default" ? root.at("default_part") : root.at("parts").at(part.part);
    if (map.is_nothing()) continue;  // the default part of a file without that key
    const auto put_value = [&](const YamlNode& of, const char* key,
                               const std::optional<Measured>& measured, double factor, int decimals,
                               const char* unit) {
      if (measured && !of.is_nothing())
        put(text, of, key, fixed(factor * measured->value, decimals) + unit, edits);
    };
    put_value(map, "surface_sigma", part.surface_sigma, 1e3, 2, " mm");
    put_value(map, "correlation_length", part.correlation_length, 1e3, 0, " mm");
    put_value(map, "reflectivity", part.reflectivity, 1, 3, "");
    put_value(map.at("joint"), "rest", part.joint_angle, degrees(1), 2, " deg");
  }
  // From the end, so that places stay.
  std::stable_sort(edits.begin(), edits.end(),
                   [](const Edit& a, const Edit& b) { return a.begin > b.begin; });
  for (const Edit& edit : edits) text.replace(edit.begin, edit.end - edit.begin, edit.text);
  read_yaml(text, name);  // it is still one
  return text;
}

}  // namespace berth::targets
