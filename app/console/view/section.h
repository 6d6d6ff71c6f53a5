// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "common/bus/loop.h"
#include "common/core/pose.h"
#include "logs/types/type_catalogue.h"

namespace berth::console {

using Json = nlohmann::ordered_json;

/// The value to a multiple of the step, so that its text is short; null when it is not finite.
Json rounded(double value, double step);
/// x, y, z to 10 um.
Json json_of(const Vector3d& v, double step = 1e-5);
/// [x, y, z, qw, qx, qy, qz], m.
Json json_of(const Pose& pose);
/// [x, y, z, w, p, r], mm and degrees.
Json json_of(const Xyzwpr& xyzwpr);

std::string text_of(const Json& json);

/// A message with its fields by their names; empty when it is of no known type or damaged.
std::string json_of_message(const logs::TypeCatalogue& types, Bytes message);

/// Takes what a view has to show: the sections of PROTOCOL.md by their names, as JSON texts.
class Sink {
 public:
  virtual ~Sink() = default;

  /// The time of what comes next: in the cell, or of a replay in its log.
  virtual void at(Utime utime) = 0;
  /// Replaces a section.
  virtual void set(const std::string& section, std::string json) = 0;
  /// Appends to a list: an entry, or several with commas between them.
  virtual void add(const std::string& list, std::string json) = 0;
  /// Empties a list.
  virtual void reset(const std::string& list) = 0;
};

}  // namespace berth::console
