// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>

/// SVG, and the elements of HTML around it.
namespace berth::svg {

/// A piece of a document. Text from outside becomes one only by text() and as an attribute, which
/// escape it, so that no text of a log can become markup.
struct Markup {
  std::string code;

  Markup& operator+=(const Markup& other) {
    code += other.code;
    return *this;
  }
  bool empty() const { return code.empty(); }
};

inline Markup operator+(Markup a, const Markup& b) { return std::move(a += b); }

/// Any text, escaped for element content and for attributes in double quotes. Control characters
/// and bytes that are not UTF-8 become U+FFFD.
Markup text(std::string_view any);

/// With at most one decimal: a tenth of a unit of the picture is less than a pixel.
std::string number(double value);

/// A number() or any text, which is escaped; an empty one is left out.
struct Attribute {
  template <class Number, class = std::enable_if_t<std::is_arithmetic_v<Number>>>
  Attribute(const char* name_of, Number number_of)
      : name(name_of), value(number(static_cast<double>(number_of))) {}
  Attribute(const char* name_of, std::string_view any) : name(name_of), value(text(any).code) {}

  const char* name;
  std::string value;
};
using Attributes = std::initializer_list<Attribute>;

/// <name attributes/>
Markup element(const char* name, Attributes attributes);
/// <name attributes>content</name>
Markup element(const char* name, Attributes attributes, const Markup& content);

/// Content of the attribute d of a path.
class Path {
 public:
  /// A command of SVG (M, L, H, V, h, z ...) with its numbers.
  Path& add(char command, std::initializer_list<double> numbers = {});
  /// With round ends a line without length is a dot, however it is stretched.
  Path& dot(double x, double y) { return add('M', {x, y}).add('h', {0}); }

  operator std::string_view() const { return data_; }
  bool empty() const { return data_.empty(); }

 private:
  std::string data_;
};

/// From 0 to 255.
struct Colour {
  double red, green, blue;
};
/// "#rrggbb" @param shade from 0, black, to 1, the colour
std::string hex(const Colour& colour, double shade = 1);

/// A picture within HTML, as wide as its style.
Markup image(double width, double height, const Markup& content);

/// A complete file. @param width, height pixels @param background a colour
std::string document(double width, double height, std::string_view background,
                     const Markup& content);

}  // namespace berth::svg
