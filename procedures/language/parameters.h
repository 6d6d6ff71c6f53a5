// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/core/quantity.h"

namespace berth::procedures {

/// NAME=VALUE as an operator gives it with --set, or a call with its parameters.
using Overrides = std::map<std::string, std::string>;

/// The text of a procedure with its parameters filled in.
struct Filled {
  struct Reference {
    std::string name;
    std::size_t line = 0;  ///< from 1
  };
  std::string text;                   ///< lines keep their numbers
  std::vector<Reference> references;  ///< left open: $<name> stands in the text
  std::vector<std::string> names;     ///< of the parameters
  std::vector<Reference> unused;      ///< parameters that nothing refers to
  bool as_run = false;                ///< it was filled in before, when it was run
};

/// Replaces the values in the block `parameters` by the overrides, and every ${name} by its value;
/// one of another name becomes $<name>, to be filled in by a sweep. A reference alone between
/// quotes stands for its value: "${start}" is a list when start is one. What comes after the line
/// `called:` stays as it is.
///
///     parameters:
///       speed: 20 mm/s              # one per line, on this line
///       start: [100, -100, 5500, 10, 8, -12]
///
/// @throws InputError with file and line for an override that names no parameter or is of another
/// kind than the value it replaces.
Filled apply_parameters(const std::string& text, const std::string& file,
                        const Overrides& overrides);

/// The text with every $<name> replaced by the value.
std::string fill(const std::string& text, const std::string& name, const std::string& value);

/// "there are: speed, start", for messages.
std::string known_names(const std::vector<std::string>& names);

/// The dimension of a quantity such as "20 mm/s"; nothing for other text.
std::optional<Dimension> dimension_of(const std::string& value);

}  // namespace berth::procedures
