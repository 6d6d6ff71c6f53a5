// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "common/core/table.h"

namespace berth::report {

/// A piece of HTML. Text from outside becomes one only by text(), which escapes it, so that nothing
/// a log says can become markup.
struct Html {
  std::string code;

  Html& operator+=(const Html& other) {
    code += other.code;
    return *this;
  }
  bool empty() const { return code.empty(); }
};

inline Html operator+(Html a, const Html& b) { return std::move(a += b); }

/// Any text, escaped for element content and for attributes in double quotes. Control characters
/// and bytes that are not UTF-8 become U+FFFD.
Html text(std::string_view any);
/// Markup written here, in the program.
Html markup(std::string code);
/// <name class="classes">content</name>
Html element(const char* name, const char* classes, const Html& content);
/// Link to a file beside the page, or below or above it; everything but letters, digits and -._~/
/// is percent-encoded.
Html link(std::string_view relative_path, const Html& content);

/// A table of HTML. It scrolls sideways where the page is narrow.
using HtmlTable = TableOf<Html>;
Html html_of(const HtmlTable& table);

}  // namespace berth::report
