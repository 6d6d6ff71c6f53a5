// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/svg.h"

#include <cstdio>

#include "common/core/text.h"
#include "common/core/valid_text.h"

namespace berth::svg {
namespace {

std::string opened(const char* name, Attributes attributes) {
  std::string code = std::string("<") + name;
  for (const Attribute& attribute : attributes) {
    if (attribute.value.empty()) continue;
    code.append(" ").append(attribute.name).append("=\"").append(attribute.value).append("\"");
  }
  return code;
}

std::string view_box(double width, double height) {
  return "0 0 " + number(width) + " " + number(height);
}

}  // namespace

Markup text(std::string_view any) { return {markup_text(any)}; }

std::string number(double value) {
  std::string digits = fixed(value, 1);
  if (digits.ends_with(".0")) digits.resize(digits.size() - 2);
  return digits;
}

Markup element(const char* name, Attributes attributes) {
  return {opened(name, attributes) + "/>"};
}

Markup element(const char* name, Attributes attributes, const Markup& content) {
  return {opened(name, attributes) + ">" + content.code + "</" + name + ">"};
}

Path& Path::add(char command, std::initializer_list<double> numbers) {
  data_ += command;
  for (const double* value = numbers.begin(); value != numbers.end(); ++value) {
    if (value != numbers.begin()) data_ += ' ';
    data_ += number(*value);
  }
  return *this;
}

std::string hex(const Colour& colour, double shade) {
  char digits[8];
  std::snprintf(digits, sizeof digits, "#%02x%02x%02x", static_cast<unsigned>(colour.red * shade),
                static_cast<unsigned>(colour.green * shade),
                static_cast<unsigned>(colour.blue * shade));
  return digits;
}

Markup image(double width, double height, const Markup& content) {
  return element("svg", {{"viewBox", view_box(width, height)}, {"role", "img"}}, content);
}

std::string document(double width, double height, std::string_view background,
                     const Markup& content) {
  const Markup paper =
      element("rect", {{"width", width}, {"height", height}, {"fill", background}});
  return element("svg",
                 {{"xmlns", "http://www.w3.org/2000/svg"},
                  {"viewBox", view_box(width, height)},
                  {"width", width},
                  {"height", height},
                  {"font-family", "system-ui, DejaVu Sans, Helvetica, sans-serif"},
                  {"font-size", 12},
                  {"fill", "#1b2025"}},
                 paper + Markup{"\n"} + content)
             .code +
         "\n";
}

}  // namespace berth::svg
