// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "common/core/random.h"

namespace berth::campaigns {

/// One value, or where it is drawn from.
struct Draw {
  enum class Kind { value, uniform, normal, log_uniform, choice, attitude };
  Kind kind = Kind::value;
  std::vector<std::string> texts;  ///< of a value (one) or a choice
  double a = 0;                    ///< low; mean of a normal
  double b = 0;                    ///< high; sigma of a normal
  std::string unit;                ///< of a and b, as in "20 mm/s"; empty: none
};

/// A parameter of the experiment, or a key of a configuration file
/// ("twin.yaml:compute_delay.testbed").
struct Parameter {
  std::string name;
  int line = 0;  ///< in the manifest
  /// Grid: each entry a value of the axis. Drawn and fixed: one entry.
  /// A value is a list when it has several draws, as a pose does.
  std::vector<std::vector<Draw>> values;
  bool is_list = false;  ///< values are written [a, b, c]
};

/// A value as a person writes it with --set, and the attitude drawn within, if any.
struct DrawnValue {
  std::string text;
  std::optional<Quaterniond> attitude;
};

/// @param which of the parameter's values
DrawnValue draw(const Parameter& parameter, std::size_t which, Random& random);

/// The number in a text such as "20 mm/s", and its unit: {20, "mm/s"}. Nothing for other text.
struct Quantity {
  double value = 0;
  std::string unit;
};
std::optional<Quantity> quantity_of(const std::string& text);

/// The sections of a manifest: a list of values for each, or a distribution.
/// @throws InputError with file, line and key.
std::vector<Parameter> read_grid(Config& manifest);
std::vector<Parameter> read_drawn(Config& manifest);
std::vector<Parameter> read_fixed(Config& manifest);

}  // namespace berth::campaigns
