// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/lcm_parser.h"

#include <algorithm>
#include <cstdlib>

#include "logs/types/lcm_tokens.h"

namespace berth::logs {
namespace {

struct Suffix {
  std::string_view end;
  std::string_view unit;
};
/// Longer ones first, where one is the end of another.
constexpr Suffix suffixes[] = {
    {"_m_s2", "m/s^2"}, {"_mm_s2", "mm/s^2"}, {"_rad_s2", "rad/s^2"}, {"_deg_s2", "deg/s^2"},
    {"_mm_s", "mm/s"},  {"_m_s", "m/s"},      {"_rad_s", "rad/s"},    {"_deg_s", "deg/s"},
    {"_m_s3", "m/s^3"}, {"_m", "m"},          {"_mm", "mm"},          {"_um", "um"},
    {"_km", "km"},      {"_mrad", "mrad"},    {"_urad", "urad"},      {"_rad", "rad"},
    {"_deg", "deg"},    {"_ms", "ms"},        {"_us", "us"},          {"_ns", "ns"},
    {"_s", "s"},        {"_hz", "Hz"},        {"_khz", "kHz"},        {"_mhz", "MHz"},
    {"_kg", "kg"},      {"_nm", "nm"},        {"_percent", "%"},      {"_bytes", "B"},
    {"_mb", "MB"},      {"_volt", "V"},       {"_kelvin", "K"},
};

constexpr std::string_view words[] = {
    "m",  "mm", "um", "km",    "rad",   "mrad",  "urad",    "deg",  "s",
    "ms", "us", "ns", "Hz",    "kHz",   "MHz",   "m/s",     "mm/s", "kg",
    "g",  "N",  "Nm", "rad/s", "deg/s", "m/s^2", "rad/s^2", "V",    "A",
    "W",  "K",  "Pa", "%",     "degC",  "lux",   "J",       "dB",
};

struct Spelt {
  std::string_view word;
  std::string_view unit;
};
constexpr Spelt spelt[] = {
    {"metres", "m"},       {"meters", "m"},        {"radians", "rad"},     {"degrees", "deg"},
    {"seconds", "s"},      {"milliseconds", "ms"}, {"microseconds", "us"}, {"nanoseconds", "ns"},
    {"millimetres", "mm"}, {"millimeters", "mm"},
};

std::string known(std::string_view word) {
  if (std::find(std::begin(words), std::end(words), word) != std::end(words)) {
    return std::string(word);
  }
  for (const Spelt& s : spelt) {
    if (s.word == word) return std::string(s.unit);
  }
  return "";
}

/// "utime" as a word of the name: microseconds since the epoch, by LCM's convention.
bool has_utime(std::string_view name) {
  const auto at = name.find("utime");
  if (at == std::string_view::npos || (at > 0 && name[at - 1] != '_')) return false;
  const auto end = at + 5;
  return end == name.size() || name[end] == '_';
}

}  // namespace

std::string unit_of(std::string_view name, std::string_view comment) {
  if (has_utime(name)) return "us";
  for (const Suffix& suffix : suffixes) {
    if (name.size() > suffix.end.size() &&
        name.substr(name.size() - suffix.end.size()) == suffix.end) {
      return std::string(suffix.unit);
    }
  }
  const std::string first = known(comment.substr(0, comment.find_first_of(" ,;:.")));
  if (!first.empty()) return first;
  const auto open = comment.find('[');
  const auto close = comment.find(']', open == std::string_view::npos ? 0 : open);
  if (open == std::string_view::npos || close == std::string_view::npos) return "";
  return known(comment.substr(open + 1, close - open - 1));
}

namespace {

struct Primitive {
  const char* name;
  Kind kind;
};
constexpr Primitive primitives[] = {
    {"int8_t", Kind::int8},   {"int16_t", Kind::int16}, {"int32_t", Kind::int32},
    {"int64_t", Kind::int64}, {"byte", Kind::byte},     {"boolean", Kind::boolean},
    {"float", Kind::real32},  {"double", Kind::real64}, {"string", Kind::text},
};

Kind kind_of(const std::string& type_name) {
  for (const Primitive& p : primitives) {
    if (type_name == p.name) return p.kind;
  }
  return Kind::structure;
}

bool is_integer(Kind kind) { return kind <= Kind::int64; }

std::int64_t update(std::int64_t hash, char c) {
  const auto shifted = static_cast<std::int64_t>(static_cast<std::uint64_t>(hash) << 8);
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(shifted ^ (hash >> 55)) +
                                   static_cast<std::uint64_t>(static_cast<std::int64_t>(c)));
}

std::int64_t update(std::int64_t hash, const std::string& text) {
  hash = update(hash, static_cast<char>(text.size()));
  for (const char c : text) hash = update(hash, c);
  return hash;
}

/// As lcm_struct_hash() of lcm-gen: over the members' names, types unless they are structs, and
/// dimensions; the struct's own name is left out.
std::uint64_t base_hash_of(const StructType& type) {
  std::int64_t hash = 0x12345678;
  for (const Field& field : type.fields) {
    hash = update(hash, field.name);
    if (field.kind != Kind::structure) hash = update(hash, field.type_name);
    hash = update(hash, static_cast<char>(field.dimensions.size()));
    for (const Dimension& dimension : field.dimensions) {
      hash = update(hash, static_cast<char>(dimension.count_field >= 0 ? 1 : 0));
      hash = update(hash, dimension.size);
    }
  }
  return static_cast<std::uint64_t>(hash);
}

class Parser {
 public:
  Parser(std::string_view text, const std::string& file) : tokens_(text, file), file_(file) {}

  std::vector<StructType> parse() {
    std::vector<StructType> types;
    while (!tokens_.at_end()) {
      if (tokens_.take_if("package")) {
        package_ = tokens_.name("the name of a package", true);
        tokens_.require(";");
      } else if (tokens_.peek() == "struct") {
        types.push_back(structure());
      } else {
        const std::string found = tokens_.take("'struct'");
        throw tokens_.error(found == "enum"
                                ? "found 'enum', which lcm-gen makes no C++ of; expected 'struct'"
                                : "found '" + found + "', expected 'package' or 'struct'");
      }
    }
    return types;
  }

 private:
  std::string qualified(const std::string& name) const {
    return package_.empty() || name.find('.') != std::string::npos ? name : package_ + "." + name;
  }

  StructType structure() {
    StructType type;
    const int line = tokens_.line();
    tokens_.require("struct");
    type.source = file_ + ":" + std::to_string(line);
    type.comment = tokens_.comment(line, line);
    type.name = qualified(tokens_.name("the name of a struct"));
    tokens_.require("{");
    while (!tokens_.take_if("}")) {
      if (tokens_.take_if("const")) {
        constants(type);
      } else {
        members(type);
      }
    }
    tokens_.take_if(";");
    type.base_hash = base_hash_of(type);
    return type;
  }

  void constants(StructType& type) {
    const std::string type_name = tokens_.name("the type of a constant");
    const Kind kind = kind_of(type_name);
    if (!is_integer(kind) && kind != Kind::real32 && kind != Kind::real64) {
      throw tokens_.error("found '" + type_name + "', expected a type of numbers for a constant");
    }
    do {
      Constant constant{type_name, tokens_.name("the name of a constant"), ""};
      tokens_.require("=");
      constant.text = tokens_.take("a number");
      char* end = nullptr;
      if (is_integer(kind)) {
        std::strtoll(constant.text.c_str(), &end, 0);
      } else {
        std::strtod(constant.text.c_str(), &end);
      }
      if (*end != '\0') {
        throw tokens_.error("found '" + constant.text + "' for " + constant.name +
                            ", expected a number of type " + type_name);
      }
      type.constants.push_back(constant);
    } while (tokens_.take_if(","));
    tokens_.require(";");
  }

  /// One type, then one name or more, each with dimensions of its own.
  void members(StructType& type) {
    const int first_line = tokens_.line();
    const std::size_t first = type.fields.size();
    std::string type_name = tokens_.name("the type of a member", true);
    if (type_name == "struct" || type_name == "enum") {
      throw tokens_.error("found a " + type_name + " within a struct, expected a member");
    }
    const Kind kind = kind_of(type_name);
    if (kind == Kind::structure) type_name = qualified(type_name);
    do {
      Field field;
      field.name = tokens_.name("the name of a member");
      field.type_name = type_name;
      field.kind = kind;
      if (type.field(field.name) != nullptr) {
        throw tokens_.error("found '" + field.name + "' a second time in " + type.name);
      }
      while (tokens_.take_if("[")) field.dimensions.push_back(dimension(type));
      type.fields.push_back(field);
    } while (tokens_.take_if(","));
    tokens_.require(";");
    const std::string comment = tokens_.comment(first_line, tokens_.line_of_last());
    for (std::size_t i = first; i < type.fields.size(); ++i) {
      type.fields[i].comment = comment;
      type.fields[i].unit = unit_of(type.fields[i].name, comment);
    }
  }

  Dimension dimension(StructType& type) {
    Dimension dimension;
    dimension.size = tokens_.take("the size of an array");
    if (dimension.size[0] >= '0' && dimension.size[0] <= '9') {
      char* end = nullptr;
      dimension.length = std::strtoll(dimension.size.c_str(), &end, 0);
      if (*end != '\0' || dimension.length <= 0 || dimension.length > INT32_MAX) {
        throw tokens_.error("found '" + dimension.size + "', expected the size of an array");
      }
    } else {
      const auto field = std::find_if(type.fields.begin(), type.fields.end(),
                                      [&](const Field& f) { return f.name == dimension.size; });
      if (field == type.fields.end() || !is_integer(field->kind) || !field->dimensions.empty()) {
        throw tokens_.error("found '" + dimension.size +
                            "', expected a number or an earlier member that is one integer");
      }
      if (field->count_slot < 0) field->count_slot = type.count_slots++;
      dimension.count_field = static_cast<int>(field - type.fields.begin());
    }
    tokens_.require("]");
    return dimension;
  }

  LcmTokens tokens_;
  std::string file_;
  std::string package_;
};

}  // namespace

const Field* StructType::field(const std::string& field_name) const {
  const auto found = std::find_if(fields.begin(), fields.end(),
                                  [&](const Field& f) { return f.name == field_name; });
  return found == fields.end() ? nullptr : &*found;
}

std::vector<StructType> parse_lcm(std::string_view text, const std::string& file) {
  return Parser(text, file).parse();
}

}  // namespace berth::logs
