// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "common/core/quantity.h"

namespace berth::procedures {

/// Type of the value of a key: a quantity of a dimension, or something else.
enum class Kind {
  number,
  length,
  angle,
  time,
  speed,
  angular_speed,
  quantity,  ///< of any dimension
  count,     ///< whole number
  boolean,
  text,
  texts,        ///< list of texts
  words,        ///< one of the words given
  pose,         ///< [x, y, z, w, p, r] in mm and degrees
  poses,        ///< list of poses
  gate,         ///< [near, far]
  trajectory,   ///< map with one rule of trajectory_keys()
  waypoints,    ///< list of {at, pose}
  lengths,      ///< list of lengths
  vector,       ///< [x, y, z]
  map,          ///< keys of its own
  condition,    ///< such as "estimated_range < 4 m for 1 s"
  live,         ///< name of a live quantity
  values,       ///< list of values, or {from, to, step}
  assignments,  ///< map of names and values
  steps,        ///< list of steps
  limits,
  criteria,
  figures,
};

/// One key of the language, for parser, schema and documentation.
struct KeyInfo {
  std::string key;
  Kind kind;
  bool required = false;
  std::string default_value;  ///< the default; empty: see description
  std::string description;
  std::vector<std::string> words = {};  ///< of Kind::words
  std::vector<KeyInfo> keys = {};       ///< of Kind::map
};

/// The JSON Schema (draft 7) of a procedure, from the tables that the parser reads by: for editors.
/// procedures/schema.json is this text.
std::string json_schema();

}  // namespace berth::procedures
