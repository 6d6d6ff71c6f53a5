// SPDX-License-Identifier: BSD-3-Clause
#include "common/clouds/text_lines.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <limits>

#include "common/files/lines.h"

namespace berth::clouds {

namespace {

constexpr std::string_view blanks = " \t\v\f";
constexpr double no_number = std::numeric_limits<double>::quiet_NaN();

bool is_blank(char c) { return blanks.find(c) != std::string_view::npos; }

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

/// A spreadsheet's #N/A, #VALUE! and the like are cells, no comments.
bool is_spreadsheet_error(std::string_view text) {
  text = text.substr(0, text.find_first_of(" \t,;|\""));
  return text.size() > 1 && text[0] == '#' && (text == "#N/A" || text.back() == '!');
}

std::size_t comment_begin(std::string_view line) {
  const auto first = std::min(line.find_first_not_of(blanks), line.size());
  if (first < line.size() && line[first] == '%') return first;
  bool in_quotes = false;
  for (auto i = line.find_first_of("#/\""); i != std::string_view::npos;
       i = line.find_first_of("#/\"", i + 1)) {
    if (line[i] == '"') in_quotes = !in_quotes;
    const std::string_view rest = line.substr(i);
    const bool is_mark = rest[0] == '#' ? !is_spreadsheet_error(rest) : rest.substr(0, 2) == "//";
    if (is_mark && !in_quotes && (i == 0 || is_blank(line[i - 1]))) return i;
  }
  return line.size();
}

/// Words for a value that is missing.
bool is_missing(std::string_view cell) {
  if (cell.empty() || is_spreadsheet_error(cell)) return true;
  std::array<char, 4> word{};
  if (cell.size() > word.size()) return false;
  std::transform(cell.begin(), cell.end(), word.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const std::string_view lower(word.data(), cell.size());
  return lower == "na" || lower == "n/a" || lower == "null" || lower == "none";
}

void append_utf8(std::string& text, char32_t c) {
  const auto byte = [&](char32_t bits) { text += static_cast<char>(bits); };
  if (c < 0x80) return byte(c);
  if (c < 0x800) {
    byte(0xC0 | c >> 6);
  } else if (c < 0x10000) {
    byte(0xE0 | c >> 12);
    byte(0x80 | (c >> 6 & 0x3F));
  } else {
    byte(0xF0 | c >> 18);
    byte(0x80 | (c >> 12 & 0x3F));
    byte(0x80 | (c >> 6 & 0x3F));
  }
  byte(0x80 | (c & 0x3F));
}

/// The code units behind a byte order mark; an unpaired surrogate becomes U+FFFD.
std::string from_utf16(std::string_view bytes, bool big_endian) {
  std::string text;
  text.reserve(bytes.size() / 2);
  const auto unit = [&](std::size_t i) -> char32_t {
    const auto a = static_cast<unsigned char>(bytes[i]);
    const auto b = static_cast<unsigned char>(bytes[i + 1]);
    return static_cast<char32_t>(big_endian ? a << 8 | b : b << 8 | a);
  };
  for (std::size_t i = 2; i + 1 < bytes.size(); i += 2) {
    char32_t c = unit(i);
    if (c >= 0xD800 && c < 0xE000) {
      const char32_t low = i + 3 < bytes.size() ? unit(i + 2) : 0;
      const bool pair = c < 0xDC00 && low >= 0xDC00 && low < 0xE000;
      if (pair) i += 2;
      c = pair ? 0x10000 + ((c - 0xD800) << 10) + (low - 0xDC00) : 0xFFFD;
    }
    append_utf8(text, c);
  }
  return text;
}

}  // namespace

std::string text_of(std::string bytes, const std::string& file) {
  const std::string_view begin = std::string_view(bytes).substr(0, 2);
  if (begin == "\xFF\xFE" || begin == "\xFE\xFF") bytes = from_utf16(bytes, begin[0] == '\xFE');
  if (bytes.compare(0, 3, "\xEF\xBB\xBF") == 0) bytes.erase(0, 3);
  if (!bytes.empty() && bytes.back() == '\x1A') bytes.pop_back();  // how DOS ended a text
  if (bytes.find('\0') != std::string::npos) {
    throw InputError(file + ": found binary data, expected lines of text: x y z ...");
  }
  return bytes;
}

void split_cells(std::string_view line, char delimiter, std::vector<std::string_view>& cells) {
  cells.clear();
  if (trimmed(line).empty()) return;
  if (delimiter == ' ') line = trimmed(line);
  const auto ends_cell = [delimiter](char c) {
    return delimiter == ' ' ? is_blank(c) : c == delimiter;
  };
  std::size_t i = 0;
  while (true) {
    while (i < line.size() && is_blank(line[i]) && line[i] != delimiter) ++i;
    std::size_t end = i;
    if (i < line.size() && line[i] == '"') end = std::min(line.find('"', i + 1), line.size());
    while (end < line.size() && !ends_cell(line[end])) ++end;
    std::string_view cell = trimmed(line.substr(i, end - i));
    if (cell.size() > 1 && cell.front() == '"' && cell.back() == '"') {
      cell = trimmed(cell.substr(1, cell.size() - 2));
    }
    cells.push_back(cell);
    if (end >= line.size()) return;
    i = end + 1;
    if (delimiter == ' ') {
      while (i < line.size() && is_blank(line[i])) ++i;
    }
  }
}

bool parse_number(std::string_view cell, char decimal, double& number) {
  number = no_number;
  if (is_missing(cell)) return true;
  if (decimal == '.') return files::parse_number(cell, number);
  const auto mark = cell.find(decimal);
  std::string with_point(cell);
  if (mark != std::string_view::npos) {
    const char next = mark + 1 < cell.size() ? cell[mark + 1] : '\0';
    if (std::isdigit(static_cast<unsigned char>(next)) == 0 && next != '#') return false;
    with_point[mark] = '.';
  }
  return cell.find('.') == std::string_view::npos && files::parse_number(with_point, number);
}

bool TextLines::next() {
  if (text_.empty()) return false;
  const std::size_t end = std::min(text_.find_first_of("\r\n"), text_.size());
  std::string_view line = text_.substr(0, end);
  const std::size_t mark = text_.substr(end, 2) == "\r\n" ? 2 : 1;
  text_.remove_prefix(std::min(end + mark, text_.size()));
  ++line_;
  const std::size_t comment = comment_begin(line);
  comment_ = line.substr(std::min(comment, line.size()));
  comment_.remove_prefix(std::min(comment_.size(), comment_.substr(0, 2) == "//" ? 2UL : 1UL));
  line_text_ = line.substr(0, comment);
  split_cells(line_text_, format_.delimiter, cells_);
  return true;
}

double TextLines::number(std::size_t i, const char* name) const {
  if (i >= cells_.size()) {
    throw error("found " + std::to_string(cells_.size()) + " columns, expected " + name +
                    " in column " + std::to_string(i + 1),
                i);
  }
  double value = 0;
  if (!parse_number(cells_[i], format_.decimal, value)) {
    throw error("found " + files::quoted(cells_[i]) + " for " + name + ", expected a number", i);
  }
  return value;
}

std::size_t TextLines::count(std::size_t i, const char* name) const {
  const double value = number(i, name);
  constexpr double max_count = 1e9;
  if (!(value >= 1 && value <= max_count &&
        value == static_cast<double>(static_cast<long>(value)))) {
    throw error("found " + files::quoted(cells_[i]) + " for " + name +
                ", expected a whole number of at least 1");
  }
  return static_cast<std::size_t>(value);
}

LineError TextLines::error(const std::string& what, std::size_t cell) const {
  return {file_ + ":" + std::to_string(line_) + ": " + what, line_, cell};
}

}  // namespace berth::clouds
