// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "logs/types/value.h"

namespace berth::logs {

/// Appends a message as a JSON object, as json_of() has it, without the tree in between. Numbers
/// have all their digits; those that are not finite are null.
void append_json(const StructType& type, const Value& value, std::string& out);

/// Appends a text with its quotation marks.
void append_json(std::string_view text, std::string& out);

/// The JSON schema of a type: fields with their comments and units.
std::string json_schema_of(const StructType& type);

}  // namespace berth::logs
