// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace berth::procedures {

/// The JSON Schema (draft 7) of a procedure, from the tables that the parser reads by: for editors.
/// procedures/schema.json is this text.
std::string json_schema();

}  // namespace berth::procedures
