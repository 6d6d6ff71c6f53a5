// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/core/config.h"
#include "procedures/language/key_info.h"
#include "procedures/language/steps.h"

namespace berth::procedures {

/// What a verb's reader gives: the verb, and how long it may take when the step does not say.
struct Read {
  Verb verb;
  double timeout;
};

/// One verb of the language, as the parser reads it, the schema says it and the documentation
/// tells. Behind it stands a map of keys, or one value, or either.
struct VerbInfo {
  std::string name;
  std::string description;
  std::string timeout;        ///< when the step does not say
  std::vector<KeyInfo> keys;  ///< of the map; empty: takes no map
  Read (*from_map)(Config& map) = nullptr;
  std::optional<Kind> value = std::nullopt;    ///< the one value; nothing: takes none
  Read (*from_value)(Config& step) = nullptr;  ///< the step; also of a verb that takes nothing
};

/// All but the blocks.
const std::vector<VerbInfo>& verbs();
/// nullptr when there is none of this name.
const VerbInfo* verb_named(const std::string& name);
/// Reads what stands behind the verb in a step. @throws InputError.
Read read_verb(const VerbInfo& verb, Config& step);

/// What a lights step says. @param lights what holds where it says nothing
Lights read_lamps(Config& config, Lights lights);

/// Complains of keys that nobody knows. @throws std::logic_error when the reader asked for a key
/// that the table does not have: the two must not drift apart.
void finish_keys(const Config& map, const std::vector<KeyInfo>& keys, const std::string& where);

}  // namespace berth::procedures
