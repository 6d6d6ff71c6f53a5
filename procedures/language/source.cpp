// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/source.h"

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

}  // namespace berth::procedures
