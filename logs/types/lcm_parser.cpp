// SPDX-License-Identifier: BSD-3-Clause
#include "logs/types/lcm_parser.h"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/error.h"
#include "logs/types/unit.h"

namespace berth::logs {

/// The words of a .lcm file one after another, comments apart.
class LcmTokens {
 public:
  /// file: for messages. @throws InputError for a character that has no place in such a file.
  LcmTokens(std::string_view text, std::string file);

  bool at_end() const { return next_ == tokens_.size(); }
  /// The next word, or "" at the end.
  std::string_view peek() const;
  /// Line of the next word.
  int line() const;
  int line_of_last() const { return next_ == 0 ? 1 : tokens_[next_ - 1].line; }

  /// The next word. @throws InputError at the end; expected: for the message.
  std::string take(const char* expected);
  bool take_if(std::string_view word);
  void require(const char* word);
  /// A name: letters, digits and '_', not a digit first; with dots when it may have a package.
  std::string name(const char* expected, bool with_package = false);

  /// The comment behind a declaration that ends in this line; else the one in the lines above it.
  std::string comment(int first_line, int last_line) const;

  /// "file:line: found '...', expected ..."; at the last word taken.
  InputError error(const std::string& what) const;

 private:
  struct Token {
    std::string text;
    int line;
  };
  struct Comment {
    std::string text;
    int line;
    bool alone;  ///< nothing stands before it in its line
  };

  void add_comment(std::string_view text, int line, bool alone);

  std::string file_;
  std::vector<Token> tokens_;
  std::vector<Comment> comments_;  ///< one a line, in order
  std::size_t next_ = 0;
};

namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.'; }
bool is_space(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (is_space(text.front()) || text.front() == '*' || text.front() == '/')) {
    text.remove_prefix(1);
  }
  while (!text.empty() && is_space(text.back())) text.remove_suffix(1);
  return text;
}

/// A number may have a sign and an exponent with one: -1.5e-3.
std::size_t word_end(std::string_view text, std::size_t at) {
  const bool number =
      text[at] == '-' || text[at] == '+' || std::isdigit(static_cast<unsigned char>(text[at])) != 0;
  const bool hexadecimal = text.substr(at, 2) == "0x" || text.substr(at, 2) == "0X";
  std::size_t end = at + 1;
  while (end < text.size() &&
         (is_word(text[end]) || (number && !hexadecimal && (text[end] == '-' || text[end] == '+') &&
                                 (text[end - 1] == 'e' || text[end - 1] == 'E')))) {
    ++end;
  }
  return end;
}

}  // namespace

LcmTokens::LcmTokens(std::string_view text, std::string file) : file_(std::move(file)) {
  int line = 1;
  bool line_is_empty = true;
  for (std::size_t at = 0; at < text.size();) {
    const char c = text[at];
    if (c == '\n') {
      ++line;
      line_is_empty = true;
      ++at;
    } else if (is_space(c)) {
      ++at;
    } else if (text.substr(at, 2) == "//") {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      add_comment(text.substr(at + 2, end - at - 2), line, line_is_empty);
      at = end;
    } else if (text.substr(at, 2) == "/*") {
      const std::size_t close = text.find("*/", at + 2);
      if (close == std::string_view::npos) {
        throw InputError(file_ + ":" + std::to_string(line) + ": found no end of this comment");
      }
      for (std::size_t from = at + 2; from <= close;) {
        const std::size_t end = std::min(text.find('\n', from), close);
        add_comment(text.substr(from, end - from), line, line_is_empty);
        if (end < close) {
          ++line;
          line_is_empty = true;
        }
        from = end + 1;
      }
      at = close + 2;
    } else {
      std::size_t end = at + 1;
      if (is_word(c) || c == '-' || c == '+') {
        end = word_end(text, at);
      } else if (std::string_view("{}[](),;=").find(c) == std::string_view::npos) {
        throw InputError(file_ + ":" + std::to_string(line) + ": found '" + std::string(1, c) +
                         "', which has no place in a message type");
      }
      tokens_.push_back({std::string(text.substr(at, end - at)), line});
      line_is_empty = false;
      at = end;
    }
  }
}

void LcmTokens::add_comment(std::string_view text, int line, bool alone) {
  text = trimmed(text);
  if (!text.empty()) comments_.push_back({std::string(text), line, alone});
}

std::string_view LcmTokens::peek() const {
  return at_end() ? std::string_view() : std::string_view(tokens_[next_].text);
}

int LcmTokens::line() const { return at_end() ? line_of_last() : tokens_[next_].line; }

std::string LcmTokens::take(const char* expected) {
  if (at_end()) throw error(std::string("found the end of the file, expected ") + expected);
  return tokens_[next_++].text;
}

bool LcmTokens::take_if(std::string_view word) {
  if (peek() != word) return false;
  ++next_;
  return true;
}

void LcmTokens::require(const char* word) {
  const std::string found = take((std::string("'") + word + "'").c_str());
  if (found != word) throw error("found '" + found + "', expected '" + word + "'");
}

std::string LcmTokens::name(const char* expected, bool with_package) {
  const std::string found = take(expected);
  const bool sound = !std::isdigit(static_cast<unsigned char>(found[0])) && found[0] != '.' &&
                     found.back() != '.' && found.find("..") == std::string::npos &&
                     std::all_of(found.begin(), found.end(), is_word) &&
                     (with_package || found.find('.') == std::string::npos);
  if (!sound) throw error("found '" + found + "', expected " + expected);
  return found;
}

std::string LcmTokens::comment(int first_line, int last_line) const {
  std::string behind;
  std::string above;
  int above_line = first_line;
  for (auto c = comments_.rbegin(); c != comments_.rend(); ++c) {
    if (!c->alone && c->line >= first_line && c->line <= last_line) {
      behind = c->text + (behind.empty() ? "" : " ") + behind;
    } else if (c->alone && c->line == above_line - 1) {
      above = c->text + (above.empty() ? "" : " ") + above;
      above_line = c->line;
    }
  }
  return behind.empty() ? above : behind;
}

InputError LcmTokens::error(const std::string& what) const {
  return InputError(file_ + ":" + std::to_string(line_of_last()) + ": " + what);
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

const Field* StructType::field(const std::string& wanted) const {
  const auto found =
      std::find_if(fields.begin(), fields.end(), [&](const Field& f) { return f.name == wanted; });
  return found == fields.end() ? nullptr : &*found;
}

std::vector<StructType> parse_lcm(std::string_view text, const std::string& file) {
  return Parser(text, file).parse();
}

}  // namespace berth::logs
