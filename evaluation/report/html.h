// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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

/// Link to a file beside the page, or below or above it; everything but letters, digits and -._~/
/// is percent-encoded.
Html link(std::string_view relative_path, const Html& content);

/// A table of HTML. It scrolls sideways where the page is narrow.
using HtmlTable = TableOf<Html>;
Html html_of(const HtmlTable& table);

}  // namespace berth::report
