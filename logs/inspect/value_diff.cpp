// SPDX-License-Identifier: BSD-3-Clause
#include "logs/inspect/value_diff.h"

#include <cmath>

#include "common/core/valid_text.h"

namespace berth::logs {
namespace {

std::string shown_value(const Value& value) {
  return std::visit(
      [](const auto& v) -> std::string {
        using Type = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<Type, std::string_view>) {
          return "'" + std::string(first_columns(v, 60)) + (columns(v) > 60 ? "..." : "") + "'";
        } else if constexpr (std::is_same_v<Type, Value::List>) {
          return std::to_string(v.size()) + " elements";
        } else {
          return json_text(nlohmann::json(v));
        }
      },
      value.content);
}

class Comparer {
 public:
  Comparer(double tolerance, const std::function<bool(const std::string&)>& ignored)
      : tolerance_(tolerance), ignored_(ignored) {}

  void structure(const StructType& type, const Value& a, const Value& b,
                 const std::string& prefix) {
    for (std::size_t i = 0; i < type.fields.size(); ++i) {
      const Field& field = type.fields[i];
      const std::string path = prefix + field.name;
      if (ignored_(path)) continue;
      array(field, field.dimensions.size(), a.list()[i], b.list()[i], path);
    }
  }

  ValueDiff result;

 private:
  void array(const Field& field, std::size_t dimensions, const Value& a, const Value& b,
             const std::string& path) {
    if (dimensions == 0) {
      if (field.kind == Kind::structure) {
        structure(*field.structure, a, b, path + ".");
      } else {
        element(a, b, path);
      }
      return;
    }
    if (a.list().size() != b.list().size()) {
      say(a, b, path);
      return;
    }
    for (std::size_t i = 0; i < a.list().size(); ++i) {
      array(field, dimensions - 1, a.list()[i], b.list()[i], path + "[" + std::to_string(i) + "]");
    }
  }

  void element(const Value& a, const Value& b, const std::string& path) {
    if (a.content == b.content) return;
    const bool real =
        std::holds_alternative<double>(a.content) || std::holds_alternative<float>(a.content);
    if (real) {
      const double x = *number_of(a);
      const double y = *number_of(b);
      if (std::isnan(x) && std::isnan(y)) return;
      const double distance = std::abs(x - y);
      if (!std::isnan(distance)) result.largest = std::max(result.largest, distance);
      if (distance <= tolerance_) return;
    }
    say(a, b, path);
  }

  void say(const Value& a, const Value& b, const std::string& path) {
    if (result.differs) return;
    result.differs = true;
    result.path = path;
    result.a = shown_value(a);
    result.b = shown_value(b);
  }

  double tolerance_;
  const std::function<bool(const std::string&)>& ignored_;
};

}  // namespace

ValueDiff diff_values(const StructType& type, const Value& a, const Value& b, double tolerance,
                      const std::function<bool(const std::string&)>& ignored) {
  Comparer comparer(tolerance, ignored);
  comparer.structure(type, a, b, "");
  return comparer.result;
}

}  // namespace berth::logs
