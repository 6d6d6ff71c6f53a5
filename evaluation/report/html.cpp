// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/html.h"

#include <algorithm>
#include <cctype>
#include <cstdio>

#include "common/core/text.h"

namespace berth::report {

std::string style_along(double from, double to) {
  const double begin = std::clamp(from, 0.0, 1.0);
  const double end = std::clamp(to, 0.0, 1.0);
  return "left:" + fixed(100 * begin, 2) + "%;width:" + fixed(100 * (end - begin), 2) + "%";
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

Html html_of(const HtmlTable& table) {
  Html html = markup("<div class=\"scroll\"><table><thead><tr>");
  const auto open = [&table](const char* tag, std::size_t column) {
    const bool left = column < table.alignment.size() && table.alignment[column] == 'l';
    return std::string("<") + tag + (left ? " class=\"l\">" : ">");
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
