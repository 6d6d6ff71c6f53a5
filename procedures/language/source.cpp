// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/source.h"

#include "common/core/config.h"
#include "common/core/error.h"
#include "common/core/file.h"
#include "procedures/language/sweep.h"

namespace berth::procedures {

const std::string& Library::text(const std::string& name) {
  const auto known = texts_.find(name);
  if (known != texts_.end()) return known->second;
  return texts_[name] = read_file(folder_ / name);
}

Source make_source(const std::string& text, const std::string& file, const std::string& name,
                   const Overrides& overrides) {
  Filled filled = apply_parameters(text, file, overrides);
  const auto swept = swept_names(Config::parse(filled.text, file).node());
  for (const std::string& parameter : filled.names) {
    if (swept.count(parameter) == 0) continue;
    throw InputError(file + ":1: '" + parameter +
                     "' is the name of a parameter and of a sweep, expected two names");
  }
  for (const Filled::Reference& reference : filled.references) {
    if (swept.count(reference.name) != 0) continue;
    throw InputError(file + ":" + std::to_string(reference.line) + ": parameter '" +
                     reference.name + "' is not defined; " + known_names(filled.names));
  }
  if (!filled.unused.empty() && !filled.as_run) {
    const Filled::Reference& first = filled.unused.front();
    throw InputError(file + ":" + std::to_string(first.line) + ": key 'parameters." + first.name +
                     "': is never used");
  }
  return {std::move(filled.text), file, name, filled.as_run, {}};
}

}  // namespace berth::procedures
