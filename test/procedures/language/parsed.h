// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "common/core/error.h"
#include "procedures/language/procedure.h"

namespace berth::procedures {

/// A procedure of nothing but these steps (lines of YAML).
inline std::string text_of_steps(const std::string& steps) { return "name: t\nsteps:\n" + steps; }

inline Procedure parsed_steps(const std::string& steps) {
  return parse_procedure(text_of_steps(steps), "p.yaml");
}

/// One step, after the target has been acquired.
inline Procedure parsed_step(const std::string& step) {
  return parsed_steps("  - acquire: {}\n  - " + step + "\n");
}

/// The parser's error for a text; empty: none.
inline std::string error_of(const std::string& text, const Overrides& overrides = {}) {
  try {
    parse_procedure(text, "p.yaml", overrides);
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

inline std::string error_of_steps(const std::string& steps) {
  return error_of(text_of_steps(steps));
}

}  // namespace berth::procedures
