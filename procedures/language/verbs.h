// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "procedures/language/schema.h"
#include "procedures/language/steps.h"

namespace berth::procedures {

/// Result of a verb's reader: the verb, and its default time-out.
struct Read {
  Verb verb;
  double timeout;
};

/// One verb of the language, for parser, schema and documentation. Its value is a map of keys, one
/// value, or either.
struct VerbInfo {
  std::string name;
  std::string description;
  std::string timeout;        ///< default
  std::vector<KeyInfo> keys;  ///< of the map; empty: takes no map
  Read (*from_map)(Config& map) = nullptr;
  std::optional<Kind> value = std::nullopt;    ///< the one value; nothing: takes none
  Read (*from_value)(Config& step) = nullptr;  ///< the step; also of a verb that takes nothing
};

/// All verbs but the blocks.
const std::vector<VerbInfo>& verbs();
/// nullptr when there is none of this name.
const VerbInfo* verb_named(const std::string& name);
/// Reads the value of the verb in a step. @throws InputError.
Read read_verb(const VerbInfo& verb, Config& step);

/// The lamps of a lights step. @param lights defaults of the keys that are left out
Lights read_lamps(Config& config, Lights lights);

/// @throws InputError for unknown keys, std::logic_error when the reader read a key that the table
/// does not have: the two must not drift apart.
void finish_keys(const Config& map, const std::vector<KeyInfo>& keys, const std::string& where);

// The verbs by subject, each with its reader; verbs() joins them.
std::vector<VerbInfo> cell_verbs();
std::vector<VerbInfo> motion_verbs();
std::vector<VerbInfo> scan_verbs();
std::vector<VerbInfo> operator_verbs();

/// For verbs without a value. @throws InputError when there is one.
void expect_nothing(Config& step, const std::string& verb);

}  // namespace berth::procedures
