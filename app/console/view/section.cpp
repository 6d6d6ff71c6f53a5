// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/view/section.h"

#include <cmath>

#include "common/core/valid_text.h"
#include "logs/export/json_text.h"
#include "logs/types/value.h"

namespace berth::console {

Json rounded(double value, double step) {
  if (!std::isfinite(value)) return nullptr;
  // Dividing by the inverse of a power of ten gives the number with the fewest digits.
  const double per_unit = std::round(1 / step);
  return per_unit >= 1 ? std::round(value * per_unit) / per_unit : std::round(value / step) * step;
}

Json json_of(const Vector3d& v, double step) {
  return {rounded(v.x(), step), rounded(v.y(), step), rounded(v.z(), step)};
}

Json json_of(const Pose& pose) {
  Json json = json_of(pose.position);
  const Quaterniond& q = pose.rotation;
  for (const double value : {q.w(), q.x(), q.y(), q.z()}) json.push_back(rounded(value, 1e-6));
  return json;
}

Json json_of(const Xyzwpr& xyzwpr) {
  Json json = Json::array();
  for (const double value : xyzwpr) json.push_back(rounded(value, 1e-3));
  return json;
}

std::string text_of(const Json& json) { return json_text(json); }

std::string json_of_message(const logs::TypeCatalogue& types, Bytes message) {
  std::string text;
  const logs::StructType* type = types.type_of(message);
  if (type == nullptr) return text;
  if (const auto value = logs::decode_value(*type, message)) {
    logs::append_json(*type, *value, text);
  }
  return text;
}

}  // namespace berth::console
