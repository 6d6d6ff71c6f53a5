// SPDX-License-Identifier: BSD-3-Clause
#include "logs/report/html.h"

#include <cctype>
#include <cstdio>

namespace berth::report {
namespace {

constexpr std::string_view replacement = "\xEF\xBF\xBD";  // U+FFFD

/// Length of the well-formed UTF-8 sequence that begins here; 0 when there is none (Unicode 15,
/// table 3-7).
std::size_t utf8_length(std::string_view at) {
  const auto byte = [&at](std::size_t i) {
    return i < at.size() ? static_cast<unsigned char>(at[i]) : 0u;
  };
  const auto tail = [&byte](std::size_t i) { return (byte(i) & 0xC0u) == 0x80u; };
  const unsigned a = byte(0);
  const unsigned b = byte(1);
  if (a < 0x80) return 1;
  if (a >= 0xC2 && a <= 0xDF && tail(1)) return 2;
  const bool second_of_three = tail(1) && !(a == 0xE0 && b < 0xA0) && !(a == 0xED && b > 0x9F);
  if (a >= 0xE0 && a <= 0xEF && second_of_three && tail(2)) return 3;
  const bool second_of_four = tail(1) && !(a == 0xF0 && b < 0x90) && !(a == 0xF4 && b > 0x8F);
  if (a >= 0xF0 && a <= 0xF4 && second_of_four && tail(2) && tail(3)) return 4;
  return 0;
}

std::string_view entity(char c) {
  switch (c) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\'':
      return "&#39;";
    default:
      return {};
  }
}

}  // namespace

Html text(std::string_view any) {
  Html html;
  while (!any.empty()) {
    const std::size_t length = utf8_length(any);
    const char c = any.front();
    const bool control =
        (c >= 0 && c < ' ' && c != '\n' && c != '\t') || static_cast<unsigned char>(c) == 0x7F;
    if (length == 0 || control) {
      html.code += replacement;
    } else if (const std::string_view e = entity(c); !e.empty()) {
      html.code += e;
    } else {
      html.code += any.substr(0, length);
    }
    any.remove_prefix(length == 0 ? 1 : length);
  }
  return html;
}

Html markup(std::string code) { return {std::move(code)}; }

Html element(const char* name, const char* classes, const Html& content) {
  const std::string opened = *classes == '\0' ? "" : std::string(" class=\"") + classes + "\"";
  return {std::string("<") + name + opened + ">" + content.code + "</" + name + ">"};
}

Html link(std::string_view relative_path, const Html& content) {
  // A first segment with a colon would be read as a scheme.
  std::string address = "./";
  for (const char c : relative_path) {
    const auto byte = static_cast<unsigned char>(c);
    if (std::isalnum(byte) != 0 || std::string_view("-._~/").find(c) != std::string_view::npos) {
      address += c;
    } else {
      char hex[4];
      std::snprintf(hex, sizeof hex, "%%%02X", byte);
      address += hex;
    }
  }
  return {"<a href=\"" + address + "\">" + content.code + "</a>"};
}

Html html_of(const Table& table) {
  Html html = markup("<div class=\"scroll\"><table><thead><tr>");
  const auto open = [&table](const char* tag, std::size_t column) {
    return std::string("<") + tag + (column < table.left_columns ? " class=\"l\">" : ">");
  };
  for (std::size_t i = 0; i < table.head.size(); ++i) {
    html += markup(open("th", i)) + text(table.head[i]) + markup("</th>");
  }
  html += markup("</tr></thead><tbody>\n");
  for (const auto& row : table.rows) {
    html += markup("<tr>");
    for (std::size_t i = 0; i < row.size(); ++i) {
      html += markup(open("td", i)) + row[i] + markup("</td>");
    }
    html += markup("</tr>\n");
  }
  return html + markup("</tbody></table></div>\n");
}

}  // namespace berth::report
