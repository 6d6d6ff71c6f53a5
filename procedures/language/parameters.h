// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/core/quantity.h"
#include "common/core/yaml.h"

namespace berth::procedures {

/// NAME=VALUE as an operator gives it with --set, or a call with its parameters.
using Overrides = std::map<std::string, std::string>;

/// A letter or underscore, then letters, digits and underscores.
bool is_name(const std::string& text);

/// A parameter with the value that the procedure gives it.
struct Parameter {
  YamlNode name;
  YamlNode value;       ///< a text, or a list
  std::string comment;  ///< behind it
};

/// A procedure as it is written.
struct Written {
  std::string text;  ///< of clean_text()
  YamlNode tree;     ///< references stand in it as $<name>
  bool as_run = false;
  std::vector<Parameter> parameters;
};

/// Reads a procedure's text. A reference may stand without quotes between braces and brackets,
/// where `${name}` is no YAML.
/// @throws InputError.
Written read_written(const std::string& text, const std::string& file);

/// A procedure with its parameters filled in.
struct Filled {
  std::string text;  ///< the values in place, comments kept
  YamlNode tree;     ///< references to sweeps are left open: $<name>
};

/// Puts the overrides in place of the parameters' values, and each parameter's value in place of
/// the references to it. A reference alone (`${start}`, or "${start}") is replaced by the value as
/// a node, which may be a list; one within a text by the value's text. Values are not parsed as
/// YAML, nor for references.
///
/// @param swept names of sweeps, whose references stay
/// @throws InputError with file and line for a reference to an unknown name, a parameter without a
/// reference, and an override that fits no parameter.
Filled apply_parameters(const Written& written, const std::string& file, const Overrides& overrides,
                        const std::set<std::string>& swept);

/// The node with every $<name> replaced by the value.
YamlNode fill(const YamlNode& node, const std::map<std::string, YamlNode>& values);

/// Throws at the first reference that is left open in the node.
/// @throws InputError.
void refuse_open_references(const YamlNode& node, const std::string& file);

/// A value, given as text, that replaces another: parsed as a list where the other is one,
/// otherwise the text itself.
/// @param name of the parameter or key, for messages
/// @throws InputError for a list of another length, or a quantity of another dimension.
YamlNode value_in_place_of(const YamlNode& before, const std::string& text,
                           const std::string& name);

/// The dimension of a quantity such as "20 mm/s"; nothing for other text.
std::optional<Dimension> dimension_of(const std::string& value);

}  // namespace berth::procedures
