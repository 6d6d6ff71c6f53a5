// SPDX-License-Identifier: BSD-3-Clause
#include "common/core/valid_text.h"

namespace berth {
namespace {

constexpr std::string_view replacement = "\xEF\xBF\xBD";

bool is_line_end_or_tab(std::string_view character) {
  return character == "\n" || character == "\r" || character == "\t";
}

/// C0, DEL and C1.
bool is_control(std::string_view character) {
  const auto last = static_cast<unsigned char>(character.back());
  if (character.size() == 1) return last < 0x20 || last == 0x7F;
  return character.size() == 2 && character[0] == '\xC2' && last < 0xA0;
}

/// The text with what `shown` makes of each of its characters.
template <class Shown>
std::string mapped(std::string_view text, Shown shown) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    if (length == 0) {
      out += replacement;
    } else {
      out += shown(text.substr(0, length));
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  return out;
}

}  // namespace

std::size_t character_length(std::string_view text) {
  const auto byte = [&text](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
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

std::string valid_utf8(std::string_view text) {
  return mapped(text, [](std::string_view character) { return character; });
}

std::string with_controls_escaped(std::string json) {
  if (json.find_first_of("\x7F\xC2") == std::string::npos) return json;
  return mapped(json, [](std::string_view character) {
    if (character == "\n" || !is_control(character)) return std::string(character);
    char escaped[8];
    std::snprintf(escaped, sizeof escaped, "\\u%04x", static_cast<unsigned char>(character.back()));
    return std::string(escaped);
  });
}

std::string markup_text(std::string_view text) {
  return mapped(text, [](std::string_view character) -> std::string_view {
    switch (character[0]) {
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
      case '\n':
        return "&#10;";
      case '\t':
        return "&#9;";
      default:
        // XML 1.0, 2.2 "Char", without the C1 characters that it discourages
        const bool none = character == "\xEF\xBF\xBE" || character == "\xEF\xBF\xBF";
        return none || is_control(character) ? replacement : character;
    }
  });
}

std::string csv_field(std::string_view text) {
  std::string out = mapped(text, [](std::string_view character) {
    if (character == "\"") return std::string_view("\"\"");
    return is_control(character) && !is_line_end_or_tab(character) ? replacement : character;
  });
  const bool quoted = out.find_first_of(",\"\n\r") != std::string::npos ||
                      (!out.empty() && (out.front() == ' ' || out.back() == ' '));
  return quoted ? '"' + out + '"' : out;
}

std::string terminal_text(std::string_view text) {
  return mapped(text, [](std::string_view character) {
    const bool kept = character == "\n" || character == "\t";
    return is_control(character) && !kept ? replacement : character;
  });
}

std::string terminal_line(std::string_view text) {
  return mapped(text, [](std::string_view character) {
    if (is_line_end_or_tab(character)) return std::string_view(" ");
    return is_control(character) ? replacement : character;
  });
}

void print_text(std::string_view text, std::FILE* file) {
  const std::string shown = terminal_text(text);
  std::fwrite(shown.data(), 1, shown.size(), file);
}

std::size_t columns(std::string_view text) {
  std::size_t count = 0;
  for (const char c : text) count += (static_cast<unsigned char>(c) & 0xC0u) != 0x80u;
  return count;
}

std::string_view first_columns(std::string_view text, std::size_t count) {
  std::size_t i = 0;
  for (; i < text.size(); ++i) {
    if ((static_cast<unsigned char>(text[i]) & 0xC0u) != 0x80u && count-- == 0) break;
  }
  return text.substr(0, i);
}

}  // namespace berth
