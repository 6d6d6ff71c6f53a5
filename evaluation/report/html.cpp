// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/report/html.h"

#include <algorithm>
#include <cctype>
#include <cstdio>

#include "common/core/file.h"
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

void Page::section(const std::string& id, const std::string& heading, const Html& content) {
  const Html name = text(heading);
  contents_ += markup("<a href=\"#" + id + "\">") + name + markup("</a> ");
  sections_ += markup("<section id=\"" + id + "\"><h2>") + name + markup("</h2>\n") + content +
               markup("</section>\n");
}

Html Page::html() const {
  return markup(
             "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
             "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
             "<meta name=\"generator\" content=\"berth\">\n"
             // For pages opened from a disk or a mail: content of a log must not load anything.
             "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; "
             "style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n<title>") +
         text(title_) + markup("</title>\n<style>\n" + std::string(page_style) + "</style>") +
         markup("</head>\n<body><header>\n") + head_ + markup("</header>\n<nav>") + contents_ +
         markup("</nav>\n<main>\n") + sections_ +
         markup("</main>\n<script>\n" + std::string(page_script) + "</script></body></html>\n");
}

void Page::write(const std::filesystem::path& file) const { write_file(file, html().code); }

}  // namespace berth::report
