// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdio>
#include <string>
#include <string_view>

/// Text of any origin (the bus, files, names) made valid in its output format: all output goes
/// through one of these. Bytes that are not UTF-8, and characters that the format cannot hold,
/// become U+FFFD.
namespace berth {

/// Bytes of the well-formed character of UTF-8 (Unicode 15, table 3-7) that a text begins with; 0
/// when it begins with none.
std::size_t character_length(std::string_view text);

/// Well-formed UTF-8.
std::string valid_utf8(std::string_view text);

/// A JSON document in which DEL and the C1 control characters are escaped, as the others are.
std::string with_controls_escaped(std::string json);

/// A JSON document (RFC 8259), on one line unless it is indented. Numbers that are not
/// finite are null. @param json nlohmann::json or ordered_json
template <class Json>
std::string json_text(const Json& json, int indent = -1) {
  return with_controls_escaped(json.dump(indent, ' ', false, Json::error_handler_t::replace));
}

/// Content, or an attribute in quotes, of XML 1.0, SVG and HTML. Line ends and tabs are kept, as
/// references.
std::string markup_text(std::string_view text);

/// One field of a CSV file (RFC 4180), in quotes where it needs them. Of the control characters
/// only line ends and tabs are kept.
std::string csv_field(std::string_view text);

/// Text for a terminal, without control sequences. Of the control characters only '\n' and tabs are
/// kept.
std::string terminal_text(std::string_view text);
/// The same in one line: line ends and tabs are blanks.
std::string terminal_line(std::string_view text);
/// Writes terminal_text().
void print_text(std::string_view text, std::FILE* file = stdout);

/// Number of characters of UTF-8 text: columns of a terminal when none is wide.
std::size_t columns(std::string_view text);
/// Its first ones.
std::string_view first_columns(std::string_view text, std::size_t count);

}  // namespace berth
