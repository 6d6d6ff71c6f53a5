// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "common/core/svg.h"
#include "common/core/table.h"

namespace berth::report {

using Html = svg::Markup;
using svg::element;
using svg::text;

/// Markup written here, in the program.
inline Html markup(std::string code) { return {std::move(code)}; }
/// <name class="classes">content</name>
inline Html element(const char* name, const char* classes, const Html& content) {
  return element(name, {{"class", classes}}, content);
}

/// Style of what lies along its parent from one part of it to another; what is outside is cut off.
std::string style_along(double from, double to);

/// Link to a file in the page's directory, or below or above it; everything but letters, digits and
/// -._~/ is percent-encoded.
Html link(std::string_view relative_path, const Html& content);

/// Scrolls sideways where the page is narrow. A row's status colours its first cell, as page.css
/// does "good", "bad" and "unsure"; notes are below.
Html html_of(const Table& table);

/// page.css and page.js, put into the program when it is built.
extern const char* const page_style;
extern const char* const page_script;

/// One self-contained HTML file: style and script inside, nothing fetched. Reads without script,
/// in light and dark, narrow and on paper.
class Page {
 public:
  explicit Page(std::string title) : title_(std::move(title)) {}

  /// Above the sections, across the whole width.
  void head(const Html& content) { head_ += content; }
  /// A section with a heading, listed in the page's contents. id: a word of letters, digits and
  /// '-', once in a page.
  void section(const std::string& id, const std::string& heading, const Html& content);

  Html html() const;
  /// Writes a temporary file and renames it: a reader never sees half a page.
  /// @throws InputError when it cannot be written.
  void write(const std::filesystem::path& file) const;

 private:
  std::string title_;
  Html head_;
  Html contents_;
  Html sections_;
};

}  // namespace berth::report
